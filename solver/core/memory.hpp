#pragma once
// Arrays for hot loops: aligned to a cache line, on huge pages where they are large, and not touched when they are
// made, so that the thread that first writes a page owns it.
#include <cstdlib>
#include <new>
#include <type_traits>
#include <utility>
#include <vector>
#if defined(__linux__)
#include <sys/mman.h>
#endif
#if defined(KUZURE_MEMKIND)
#include <hbwmalloc.h>
#endif

namespace kuzure {

template <class T> struct HugePages {
    using value_type = T;
    HugePages() = default;
    template <class U> HugePages(const HugePages<U>&) {}
    T* allocate(std::size_t n)
    {
        const std::size_t page = std::size_t(1) << 21, small = 64;
        std::size_t bytes = n * sizeof(T);
        const std::size_t align = bytes >= page ? page : small;
        bytes = (bytes + align - 1) / align * align;
#if defined(KUZURE_MEMKIND)
        // Large arrays into the high-bandwidth memory while there is some, then into the ordinary one.
        if (void* fast = nullptr; align == page && hbw_posix_memalign(&fast, align, bytes) == 0) return static_cast<T*>(fast);
        else if (align == page) throw std::bad_alloc();
#endif
        void* p = std::aligned_alloc(align, bytes ? bytes : align);
        if (!p) throw std::bad_alloc();
#if defined(__linux__)
        if (align == page) madvise(p, bytes, MADV_HUGEPAGE);
#endif
        return static_cast<T*>(p);
    }
    void deallocate(T* p, [[maybe_unused]] std::size_t n)
    {
#if defined(KUZURE_MEMKIND)
        if (n * sizeof(T) >= std::size_t(1) << 21) return hbw_free(p);
#endif
        std::free(p);
    }
    /// Leaves new elements as the memory comes: first touch belongs to the thread that writes.
    template <class U> void construct(U* p) noexcept { ::new (static_cast<void*>(p)) U; }
    template <class U, class... A> void construct(U* p, A&&... a) { ::new (static_cast<void*>(p)) U(std::forward<A>(a)...); }
    template <class U> bool operator==(const HugePages<U>&) const { return true; }
};

/// Uninitialised when resized.
template <class T> using Array = std::vector<T, HugePages<T>>;

} // namespace kuzure
