#pragma once
// Cluster lists with a skin: W consecutive particles of a column share one list of everything that can come within the
// support of any of them before the next rebuild, in the global order. Soil neighbours are record indices (owned first,
// ghosts after); wall neighbours are runs of points of one wall. Between rebuilds a pass may prune the soil lists to what
// can be in reach during the next few steps (Pall & Hess 2013): what is left out or kept never changes a bit.
#include "solver/neighbours/columns.hpp"
#include <array>

namespace kuzure {

/// A set of points for the lists: coordinates in the global order and their columns.
struct SortedPoints {
    const double *x = nullptr, *y = nullptr, *z = nullptr;
    const std::int64_t* id = nullptr;
    const ColumnSort* columns = nullptr;
    Index n = 0;
};

/// Fixed points of one wall near this rank's soil, in column order.
struct WallPoints {
    int wall = 0; // index into Scene::walls
    Array<double> x, y, z;
    Array<std::int64_t> id;
    ColumnSort columns;
    void sort(const Columns&); // puts x, y, z, id into the global order and makes columns
};

class ClusterLists {
public:
    /// Lists of all pairs closer than reach between owned soil and soil or walls; clusters of `width` particles.
    void build(const Columns&, const SortedPoints& owned, const SortedPoints& ghosts, std::span<const WallPoints> walls, double reach,
               int width);

    Index size() const { return Index(first_.size()); }
    int width() const { return width_; }
    Index first(Index c) const { return first_[c]; }
    int count(Index c) const { return count_[c]; }
    std::span<const Index> soil(Index c) const { return {soil_[c], std::size_t(n_soil_[c])}; }
    /// What the last pruning pass kept of soil(c), written by that pass: room for all of it; n < 0: not pruned yet.
    struct Pruned {
        Index* entries;
        Index& n;
    };
    Pruned pruned(Index c) { return {pruned_[c], n_pruned_[c]}; }
    /// Runs of {wall, n, point, point, ...} one after the other.
    std::span<const Index> walls(Index c) const { return {walls_[c], std::size_t(n_walls_[c])}; }
    /// Clusters whose list has no ghost, and the others.
    std::span<const Index> interior() const { return interior_; }
    std::span<const Index> rim() const { return rim_; }
    std::size_t entries() const { return entries_; }
    std::size_t wall_entries() const { return wall_entries_; }
    std::size_t bytes() const;

private:
    int width_ = 0;
    Array<Index> first_;
    Array<std::int8_t> count_;
    Array<const Index*> soil_, walls_;
    Array<Index*> pruned_;
    Array<Index> n_soil_, n_walls_, n_pruned_;
    std::vector<Array<Index>> soil_store_, wall_store_, pruned_store_; // one a thread
    std::vector<Index> interior_, rim_;
    std::size_t entries_ = 0, wall_entries_ = 0;
};

} // namespace kuzure
