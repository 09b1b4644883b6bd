#pragma once
/// How peers behave, and for how long they are shut out when they misbehave.
///
///     offences cost points, which decay:          p(t) = p(t0) 2^(-(t - t0) / half_life)
///     at `ban_at` points: a ban that ends by itself, the k-th one after    first_ban growth^(k-1), at most longest_ban
///     a ban less is remembered for each `forgive_after` of good conduct after the last one ended
///
/// Why points that decay: a damaged line or an old version of a program makes a mistake now and then, and shall go on;
/// who makes many in a short time is either broken or hostile. Why bans that end: a server that was repaired
/// comes back without anybody's help. Why longer each time: who is broken for good costs less and less.
///
/// A peer is known by what it cannot choose: its public key. Without keys there is only its name and its machine's
/// address: a hostile peer takes another name, so this then protects against broken peers only
/// (docs/security.md).
/// Bounded: k_max_peers are remembered; the one whose record weighs least makes room for a newcomer.
///
///     on a bad message:   if (const auto ban = conduct.report(who, Offence::malformed, now))
///                             lose(server, ban_sentence(*ban));
///     on HELLO:           if (const auto ban = conduct.ban_of(who, now))
///                             reject(RejectCode::banned, ban_sentence(*ban), ban->left(now));
///     on any message:     if (!conduct.may_send(who, now)) drop it, and report_flood(who, now);
///
/// The allowance of a server is that of its connection, since several servers may have one key; and with each lease it
/// is allowed an answer more: however fast it is, it is not the one who floods.
///
/// No clock: `now` is an argument and never falls. Thread safety: one thread at a time.
/// Test: tests/cluster/test_conduct.cpp

#include <array>
#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "pathscope/core/clock.hpp"
#include "pathscope/core/enum_names.hpp"
#include "pathscope/core/token_bucket.hpp"

namespace pathscope {

/// The kinds of docs/protocol.md, section 8, that tell of a fault of the sender; late and repeated results do not.
enum class Offence {
    foreign,        ///< Not a message of ours at all.
    unknown_type,   ///< Perhaps a newer program's.
    misplaced,      ///< On the wrong channel or in the wrong direction.
    malformed,      ///< A header, field or payload that breaks a rule.
    unknown_lease,  ///< An answer for work that it was never given.
    corrupt,        ///< A result whose size or hash is wrong.
    failed,         ///< It could not do its work.
    flood,          ///< More messages than anyone needs.
    false_result,   ///< Light that is not that of its samples: an audit found it (audit.hpp).
};

inline constexpr std::array k_offence_names{
    EnumName{Offence::foreign, "foreign"},
    EnumName{Offence::unknown_type, "unknown_type"},
    EnumName{Offence::misplaced, "misplaced"},
    EnumName{Offence::malformed, "malformed"},
    EnumName{Offence::unknown_lease, "unknown_lease"},
    EnumName{Offence::corrupt, "corrupt"},
    EnumName{Offence::failed, "failed"},
    EnumName{Offence::flood, "flood"},
    EnumName{Offence::false_result, "false_result"},
};
constexpr const auto& enum_table(Offence) { return k_offence_names; }

/// What an offence costs, where `ban_at` is 10. A corrupt result is dear: it is work lost, and cannot be chance. A false
/// one is a ban at once, and the longest: it was believed.
[[nodiscard]] constexpr double points_of(Offence offence) {
    switch (offence) {
        case Offence::unknown_type:
        case Offence::unknown_lease:
            return 0.5;
        case Offence::foreign:
        case Offence::misplaced:
        case Offence::malformed:
            return 1;
        case Offence::failed:
        case Offence::flood:
            return 2;
        case Offence::corrupt:
            return 4;
        case Offence::false_result:
            return 1000;
    }
    return 1;
}

struct ConductParams {
    double ban_at = 10;  ///< Points.
    TimeNs half_life = 30 * k_second_ns;
    TimeNs first_ban = 30 * k_second_ns;
    double growth = 4;
    TimeNs longest_ban = 3600 * k_second_ns;
    TimeNs forgive_after = 600 * k_second_ns;
    /// Messages of one server, besides the answers to its leases: pieces of a scene at a gigabyte per second.
    RateLimit messages{5000, 20'000};
    /// Messages of all that said no HELLO and are known by one name: a thousand servers on a machine, whose client
    /// was started again and does not know them, send 16,000 a second.
    RateLimit strangers{50'000, 100'000};
};

/// What a connection tells of the peer at its other end, and the peer cannot choose. Either may be unknown.
struct Sender {
    std::string key, address;
};

struct Ban {
    TimeNs until = 0;
    int times = 0;  ///< The how many-th of this peer, as far as remembered.
    Offence last_offence = Offence::foreign;

    [[nodiscard]] TimeNs left(TimeNs now) const { return until > now ? until - now : 0; }
};

/// "It sent too many bad messages (the last one: malformed) and may come back in 30 s."
[[nodiscard]] std::string ban_sentence(const Ban& ban, TimeNs now);

/// By which name a peer's conduct is remembered. The three kinds of names never meet: a server may call itself what it
/// likes. Before HELLO the name is empty.
[[nodiscard]] std::string conduct_name(std::string_view public_key, std::string_view name,
                                       std::string_view address);

class Conduct {
  public:
    static constexpr std::size_t k_max_peers = 8192;  ///< More than a client admits servers.

    explicit Conduct(const ConductParams& params = {}) : params_(params) {}

    /// Books an offence. The ban that it leads to, if it does. Who is banned already gets no further points: it is
    /// not heard, so it cannot know; but what it gave before may turn out to be false.
    std::optional<Ban> report(const std::string& who, Offence offence, TimeNs now);

    [[nodiscard]] std::optional<Ban> ban_of(const std::string& who, TimeNs now) const;
    [[nodiscard]] double points(const std::string& who, TimeNs now) const;

    /// Books a message of a stranger. False if its name has used up its allowance.
    bool may_send(const std::string& who, TimeNs now);
    /// Books an offence each second in which messages had to be dropped.
    std::optional<Ban> report_flood(const std::string& who, TimeNs now);

    [[nodiscard]] std::size_t remembered() const { return records_.size(); }

  private:
    struct Record {
        double points = 0;
        TimeNs points_at = 0;
        Ban ban;
        TokenBucket allowance;
        TimeNs flood_reported_until = 0;
    };

    Record& record_of(const std::string& who, TimeNs now);
    void make_room(TimeNs now);
    [[nodiscard]] double decayed(const Record& record, TimeNs now) const;
    [[nodiscard]] int bans_remembered(const Record& record, TimeNs now) const;

    ConductParams params_;
    std::map<std::string, Record> records_;
};

}  // namespace pathscope
