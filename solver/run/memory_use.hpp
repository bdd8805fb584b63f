#pragma once
// Bytes of the large arrays of one rank, by what they are for.
#include <array>
#include <cstddef>
#include <string_view>
#include <tuple>
#include <utility>

namespace kuzure {

struct MemoryUse {
    std::size_t state = 0;        // columns of the particles
    std::size_t sorting = 0;      // the column that sorting needs beside them
    std::size_t records = 0;      // what pair loops read of soil and ghosts
    std::size_t lists = 0;        // all in reach of a cluster
    std::size_t pruned_lists = 0; // of those what can meet in the next steps
    std::size_t walls = 0;        // points near the soil and their faces
    std::size_t ghosts = 0;       // where they were sorted, and what is sent and received
    static constexpr std::tuple members{&MemoryUse::state,        &MemoryUse::sorting, &MemoryUse::records, &MemoryUse::lists,
                                        &MemoryUse::pruned_lists, &MemoryUse::walls,   &MemoryUse::ghosts};
    static constexpr std::array<std::string_view, 7> names{"state", "sorting", "records", "lists", "pruned_lists", "walls", "ghosts"};
    static_assert(std::tuple_size_v<decltype(members)> == names.size());

    /// visit(name, bytes)
    template <class Visit> void for_each(Visit visit) const
    {
        [&]<std::size_t... k>(std::index_sequence<k...>) { (visit(names[k], this->*std::get<k>(members)), ...); }
        (std::make_index_sequence<names.size()>());
    }
    std::size_t all() const
    {
        std::size_t sum = 0;
        for_each([&](std::string_view, std::size_t b) { sum += b; });
        return sum;
    }
};

} // namespace kuzure
