#include "pathscope/cluster/conduct.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <tuple>

namespace pathscope {

std::string ban_sentence(const Ban& ban, TimeNs now) {
    const TimeNs seconds = (ban.left(now) + k_second_ns - 1) / k_second_ns;
    if (ban.last_offence == Offence::false_result)
        return fmt::format("It gave a false result and may come back in {} s.", seconds);
    return fmt::format("It misbehaved too often (last: {}) and may come back in {} s.",
                       name_of(ban.last_offence), seconds);
}

std::string conduct_name(std::string_view public_key, std::string_view name, std::string_view address) {
    if (!public_key.empty()) return fmt::format("key {}", public_key);
    if (name.empty()) return fmt::format("machine {}", address);
    return fmt::format("server {} {}", address, name);  // No address has a blank in it.
}

std::optional<Ban> Conduct::report(const std::string& who, Offence offence, TimeNs now) {
    Record& record = record_of(who, now);
    if (record.ban.left(now) > 0 && offence != Offence::false_result) return std::nullopt;
    record.points = decayed(record, now) + points_of(offence);
    record.points_at = now;
    if (record.points < params_.ban_at) return std::nullopt;

    const int times = bans_remembered(record, now) + 1;
    const double length = offence == Offence::false_result
                              ? double(params_.longest_ban)
                              : double(params_.first_ban) * std::pow(params_.growth, times - 1);
    record.ban = {now + TimeNs(std::min(length, double(params_.longest_ban))), times, offence};
    record.points = 0;
    return record.ban;
}

std::optional<Ban> Conduct::ban_of(const std::string& who, TimeNs now) const {
    const auto found = records_.find(who);
    if (found == records_.end() || found->second.ban.left(now) == 0) return std::nullopt;
    return found->second.ban;
}

double Conduct::points(const std::string& who, TimeNs now) const {
    const auto found = records_.find(who);
    return found == records_.end() ? 0 : decayed(found->second, now);
}

bool Conduct::may_send(const std::string& who, TimeNs now) {
    return record_of(who, now).allowance.allow(now);
}

std::optional<Ban> Conduct::report_flood(const std::string& who, TimeNs now) {
    Record& record = record_of(who, now);
    if (now < record.flood_reported_until) return std::nullopt;
    record.flood_reported_until = now + k_second_ns;
    return report(who, Offence::flood, now);
}

Conduct::Record& Conduct::record_of(const std::string& who, TimeNs now) {
    const auto found = records_.find(who);
    if (found != records_.end()) return found->second;
    if (records_.size() >= k_max_peers) make_room(now);
    return records_.emplace(who, Record{0, now, {}, TokenBucket(params_.strangers, now)}).first->second;
}

/// Forgets the peer whose record weighs least: a standing ban weighs more than bans of the past, those more than points.
void Conduct::make_room(TimeNs now) {
    const auto weight = [&](const auto& entry) {
        const Record& record = entry.second;
        return std::tuple(record.ban.left(now), bans_remembered(record, now), decayed(record, now));
    };
    records_.erase(std::min_element(records_.begin(), records_.end(),
                                    [&](const auto& a, const auto& b) { return weight(a) < weight(b); }));
}

double Conduct::decayed(const Record& record, TimeNs now) const {
    return record.points * std::exp2(-double(now - record.points_at) / double(params_.half_life));
}

int Conduct::bans_remembered(const Record& record, TimeNs now) const {
    if (now <= record.ban.until) return record.ban.times;
    const TimeNs forgiven = (now - record.ban.until) / params_.forgive_after;
    return int(std::max<TimeNs>(0, record.ban.times - forgiven));
}

}  // namespace pathscope
