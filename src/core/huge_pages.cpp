#include "pathscope/core/huge_pages.hpp"

#include <sys/mman.h>

#include <cstdlib>

namespace pathscope::detail {

void* allocate_huge(std::size_t bytes) {
    const std::size_t whole_pages = (bytes + k_huge_page_bytes - 1) / k_huge_page_bytes * k_huge_page_bytes;
    void* memory = std::aligned_alloc(k_huge_page_bytes, whole_pages);
    if (!memory) throw std::bad_alloc();
    // A wish: where it is not granted, the pages are small, and nothing else differs.
    [[maybe_unused]] const int result = madvise(memory, whole_pages, MADV_HUGEPAGE);
    return memory;
}

void free_huge(void* memory) noexcept { std::free(memory); }

}  // namespace pathscope::detail
