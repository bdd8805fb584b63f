#pragma once
// The global order of particles: columns two spacings wide, row by row in y then x; inside a column by height z, then by
// id. It is decided by positions at the last sort only, so every rank that holds a set of particles, owned or ghost,
// holds them in the same order: neighbours are summed in it, whatever the ranks, threads, clusters and list skins.
#include "solver/core/memory.hpp"
#include "solver/core/tensor.hpp"
#include "solver/scene/parts.hpp"
#include <cstdint>
#include <span>
#include <vector>

namespace kuzure {

struct Columns {
    Vector origin{};
    double width_x = 1, width_y = 1; // m
    bool flat = false;               // 2-D: one row of columns

    /// Columns for a scene whose soil starts at `low`: aligned with the lattice and with periodic lengths.
    static Columns of(const Scene&, Vector low);
    std::int32_t x_of(double x) const { return std::int32_t(std::floor((x - origin.x) / width_x)); }
    std::int32_t y_of(double y) const { return flat ? 0 : std::int32_t(std::floor((y - origin.y) / width_y)); }
};

/// Points of one set sorted into the global order.
struct ColumnSort {
    std::int32_t x0 = 0, y0 = 0, nx = 0, ny = 0; // columns [x0, x0 + nx) x [y0, y0 + ny)
    std::vector<Index> start;                    // nx * ny + 1: first sorted index of each column, y slowest
    Array<Index> order;                          // sorted index -> index in the input; may be given up when it has been followed

    /// Sorted indices of column (cx, cy); empty outside the range.
    std::pair<Index, Index> range(std::int32_t cx, std::int32_t cy) const
    {
        const std::int32_t x = cx - x0, y = cy - y0;
        if (x < 0 || y < 0 || x >= nx || y >= ny) return {0, 0};
        const std::size_t c = std::size_t(y) * nx + x;
        return {start[c], start[c + 1]};
    }
    std::size_t bytes() const { return (start.capacity() + order.capacity()) * sizeof(Index); }
};

/// Sorts points (x, y, z, id) of any number. Throws NumbersFailed if they spread over more columns than memory allows.
ColumnSort sort_into_columns(const Columns&, const double* x, const double* y, const double* z, const std::int64_t* id, Index n);

} // namespace kuzure
