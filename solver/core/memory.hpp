#pragma once
// Arrays for hot loops: aligned to a cache line, on huge pages where they are large, and not touched when they are
// made, so that the thread that first writes a page owns it.
#include <atomic>
#include <cstdlib>
#include <cstring>
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

namespace detail {
inline std::atomic<std::size_t> allocations = 0;

inline void* get(std::size_t align, std::size_t bytes, [[maybe_unused]] bool large)
{
#if defined(KUZURE_MEMKIND)
    // Large arrays into the high-bandwidth memory while there is some, then into the ordinary one.
    if (large) {
        void* fast = nullptr;
        return hbw_posix_memalign(&fast, align, bytes) == 0 ? fast : nullptr;
    }
#endif
    void* p = std::aligned_alloc(align, bytes);
#if defined(__linux__)
    if (p && large) madvise(p, bytes, MADV_HUGEPAGE);
#endif
    return p;
}
inline void give_back(void* p, [[maybe_unused]] bool large)
{
#if defined(KUZURE_MEMKIND)
    if (large) return hbw_free(p);
#endif
    std::free(p);
}
} // namespace detail

template <class T> struct HugePages {
    using value_type = T;
    HugePages() = default;
    template <class U> HugePages(const HugePages<U>&) {}
    T* allocate(std::size_t n)
    {
        const std::size_t page = std::size_t(1) << 21, line = alignof(T) > 64 ? alignof(T) : 64;
        const bool large = n * sizeof(T) >= page / 2;
        const std::size_t align = large ? page : line;
        // Loops walk many arrays at one index. Arrays that began at the same offset of a page would fight for the same few
        // ways of the first-level cache, so each begins some lines further than the one before.
        const std::size_t stagger = line * (1 + 3 * detail::allocations++ % (4096 / line));
        const std::size_t bytes = (n * sizeof(T) + stagger + align - 1) / align * align;
        char* raw = static_cast<char*>(detail::get(align, bytes, large));
        if (!raw) throw std::bad_alloc();
        char* p = raw + stagger;
        std::memcpy(p - sizeof raw, &raw, sizeof raw);
        return reinterpret_cast<T*>(p);
    }
    void deallocate(T* p, std::size_t n)
    {
        char* raw;
        std::memcpy(&raw, reinterpret_cast<char*>(p) - sizeof raw, sizeof raw);
        detail::give_back(raw, n * sizeof(T) >= std::size_t(1) << 20);
    }
    /// Leaves new elements as the memory comes: first touch belongs to the thread that writes.
    template <class U> void construct(U* p) noexcept { ::new (static_cast<void*>(p)) U; }
    template <class U, class... A> void construct(U* p, A&&... a) { ::new (static_cast<void*>(p)) U(std::forward<A>(a)...); }
    template <class U> bool operator==(const HugePages<U>&) const { return true; }
};

/// Uninitialised when resized.
template <class T> using Array = std::vector<T, HugePages<T>>;

/// What an array gets beyond what it needs, so that one that grows little by little is not moved each time: std::vector would take twice.
inline std::size_t with_slack(std::size_t n) { return n + n / 32; }
/// A size close to the memory behind it.
template <class A> void resize_closely(A& a, std::size_t n)
{
    if (n > a.capacity()) a.reserve(2 * a.size() < n ? n : with_slack(n)); // so much more was not growth
    a.resize(n);
}
/// The same where what was there is not wanted any more: never twice in memory.
template <class A> void resize_anew(A& a, std::size_t n)
{
    if (n > a.capacity()) {
        const bool grows = 2 * a.size() >= n;
        a = A();
        a.reserve(grows ? with_slack(n) : n);
    }
    a.resize(n);
}

} // namespace kuzure
