#pragma once
/// Strong integer ids: a ServerId cannot be passed where a LeaseId is meant.

#include <compare>
#include <cstdint>
#include <functional>
#include <ostream>

namespace pathscope {

template <class Tag, class Integer>
struct Id {
    Integer value = 0;

    auto operator<=>(const Id&) const = default;
    friend std::ostream& operator<<(std::ostream& out, const Id& id) { return out << +id.value; }
};

using ServerId = Id<struct ServerTag,
                    std::uint32_t>;  ///< 0 = the client's own renderer; servers count from 1, never reused.
using LeaseId = Id<struct LeaseTag, std::uint64_t>;  ///< Unique in a client session; 0 = none.
using Epoch = Id<struct EpochTag, std::uint32_t>;  ///< Rises when the render state changes what pixels mean.

inline constexpr ServerId k_local_server{0};

}  // namespace pathscope

template <class Tag, class Integer>
struct std::hash<pathscope::Id<Tag, Integer>> {
    std::size_t operator()(const pathscope::Id<Tag, Integer>& id) const {
        return std::hash<Integer>{}(id.value);
    }
};
