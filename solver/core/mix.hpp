#pragma once
#include <cstdint>

namespace kuzure {

/// Finalizer of splitmix64: every bit of the result depends on every bit of z.
constexpr std::uint64_t mix(std::uint64_t z)
{
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
    return z ^ (z >> 31);
}

} // namespace kuzure
