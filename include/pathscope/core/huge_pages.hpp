#pragma once
/// Memory in pages of 2 MiB, where the system gives them, for large tables that are read at random.
///
/// Why: the processor keeps the addresses of about 1,500 pages at hand. Of 4 KiB each they cover 6 MiB, and a walk through
/// a tree of 20 MiB misses them all the time; of 2 MiB each they cover the machine.
///
///     std::vector<Node, HugePageAllocator<Node>> nodes;
///
/// Small tables are allocated as usual. Thread safety: as std::allocator.   Test: tests/core/test_huge_pages.cpp

#include <cstddef>
#include <new>
#include <vector>

namespace pathscope {

namespace detail {
inline constexpr std::size_t k_huge_page_bytes = std::size_t{2} << 20;

[[nodiscard]] void* allocate_huge(std::size_t bytes);  ///< Throws std::bad_alloc, as allocators do.
void free_huge(void* memory) noexcept;
}  // namespace detail

template <class T>
struct HugePageAllocator {
    using value_type = T;

    HugePageAllocator() = default;
    template <class Other>
    HugePageAllocator(const HugePageAllocator<Other>&) {}

    [[nodiscard]] T* allocate(std::size_t count) {
        const std::size_t bytes = count * sizeof(T);
        if (bytes >= detail::k_huge_page_bytes) return static_cast<T*>(detail::allocate_huge(bytes));
        return static_cast<T*>(::operator new (bytes, std::align_val_t{alignof(T)}));
    }
    void deallocate(T* memory, std::size_t count) noexcept {
        if (count * sizeof(T) >= detail::k_huge_page_bytes) return detail::free_huge(memory);
        ::operator delete (memory, std::align_val_t{alignof(T)});
    }

    friend bool operator==(HugePageAllocator, HugePageAllocator) { return true; }
};

template <class T>
using HugePageVector = std::vector<T, HugePageAllocator<T>>;

}  // namespace pathscope
