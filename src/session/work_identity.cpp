#include "pathscope/session/work_identity.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>

#include "pathscope/session/build_identity.hpp"
#include "pathscope/wire/utf8.hpp"

namespace pathscope {
namespace {

/// How people know an entry of the render state.
constexpr std::array<std::pair<std::string_view, std::string_view>, 18> k_names{{
    {"scene", "scene"},
    {"files", "content of OBJ, MTL or texture files"},
    {"material", "--material"},
    {"smoothing", "--smoothing"},
    {"texel_space", "--texel-space"},
    {"camera", "camera"},
    {"size", "--size"},
    {"seed", "--seed"},
    {"light", "--light"},
    {"light_samples", "--light-samples"},
    {"hemisphere", "--hemisphere"},
    {"mis", "--mis"},
    {"sampler", "--sampler"},
    {"roulette", "--roulette"},
    {"bounces", "--bounces"},
    {"filter", "--filter, its kind or its size"},
    {"quantum", "step of exact sums"},
    {"wire", "--wire"},
}};
constexpr std::array<std::string_view, 2> k_free{"spp", "direct_spp"};
constexpr std::size_t k_longest_shown = 40;

std::string_view name_of_entry(std::string_view key) {
    const auto* found =
        std::find_if(k_names.begin(), k_names.end(), [key](const auto& entry) { return entry.first == key; });
    return found == k_names.end() ? key : found->second;
}

/// Nothing where a value is too long or too deep to be shown.
std::optional<std::string> shown(const PackValue& value) {
    if (const auto* text = value.get<std::string>())
        return text->size() <= k_longest_shown ? std::optional(*text) : std::nullopt;
    if (const auto* flag = value.get<bool>()) return *flag ? "on" : "off";
    if (const auto* number = value.get<std::uint64_t>()) return fmt::format("{}", *number);
    if (const auto* number = value.get<std::int64_t>()) return fmt::format("{}", *number);
    const auto* sides = value.get<PackArray>();
    if (!sides || sides->size() != 2) return std::nullopt;
    const auto width = shown((*sides)[0]), height = shown((*sides)[1]);
    return width && height ? std::optional(*width + "x" + *height) : std::nullopt;
}

/// Puts the sentence together.
class Differences {
  public:
    void compare(std::string_view name, const PackValue* theirs, const PackValue* ours) {
        if (theirs && ours && *theirs == *ours) return;
        const auto before = theirs ? shown(*theirs) : std::nullopt, here = ours ? shown(*ours) : std::nullopt;
        if (before && here)
            add(fmt::format("its {} is {}, not {}", name, *before, *here));
        else
            add(fmt::format("its {} is another", name));
    }
    template <class T>
    void compare(std::string_view name, const T& theirs, const T& ours) {
        if (theirs != ours) add(fmt::format("its {} is {}, not {}", name, theirs, ours));
    }
    [[nodiscard]] std::optional<std::string> text() const {
        if (text_.empty()) return std::nullopt;
        return make_printable(text_, 1000);
    }

  private:
    void add(const std::string& clause) { text_ += (text_.empty() ? "" : "; ") + clause; }

    std::string text_;
};

std::string_view on_or_off(bool on) { return on ? "on" : "off"; }

}  // namespace

WorkIdentity identity_of(const RenderState& state, const WorkPlan& plan) {
    return {build_identity(), encode_state(state), plan.block_size, plan.round_samples, plan.sampling};
}

std::optional<std::string> difference(const WorkIdentity& theirs, const WorkIdentity& ours) {
    Differences found;
    found.compare("build", theirs.build, ours.build);
    for (const auto& [key, value] : ours.state.entries())
        if (std::find(k_free.begin(), k_free.end(), key) == k_free.end())
            found.compare(name_of_entry(key), theirs.state.find(key), &value);
    for (const auto& [key, value] : theirs.state.entries())  // Of another version.
        if (!ours.state.find(key)) found.compare(key, &value, nullptr);
    found.compare("--block", theirs.block_size, ours.block_size);
    found.compare("--round", theirs.round_samples, ours.round_samples);
    found.compare("--adaptive", on_or_off(theirs.sampling.adaptive), on_or_off(ours.sampling.adaptive));
    found.compare("--target-error", theirs.sampling.target_error, ours.sampling.target_error);
    return found.text();
}

}  // namespace pathscope
