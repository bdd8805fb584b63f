#pragma once
// Cluster lists with a skin: W consecutive particles of a column share one list of everything that can come within the
// support of any of them before the next rebuild, in the global order. A list is a set of bits over the points of each column around;
// soil becomes record indices (owned first, ghosts after) when it is walked. Between rebuilds a pass prunes the soil lists to what can be
// in reach during the next few steps (Pall & Hess 2013): what is left out or kept never changes a bit.
#include "solver/core/arena.hpp"
#include "solver/neighbours/columns.hpp"
#include <array>
#include <bit>

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
    Array<std::int64_t> id; // no list needs them
    ColumnSort columns;
    void sort(const Columns&); // puts x, y, z, id into the global order and makes columns
    /// Keeps, of sorted points, those that are wanted.
    void keep(const std::vector<bool>& wanted);
    std::size_t bytes() const;
};

/// Those of 32 points that follow each other in the global order whose bit is set: bit k stands for number first + k. A column around a
/// cluster takes one or two of these, an eighth of what the numbers would.
struct Among {
    Index first;
    std::uint32_t which;
};
class PointSet {
public:
    explicit PointSet(std::span<const Among> words) : words_(words) {}
    /// visit(number), in the global order. Of 64 bits all through: a loop over what they point to then needs no further instruction for it.
    template <class Visit> KUZURE_INLINE void for_each(Visit visit) const
    {
        for (const Among& w : words_) {
            const auto first = std::size_t(w.first);
            for (std::uint64_t left = w.which; left != 0; left &= left - 1) visit(first + std::size_t(__builtin_ctzll(left)));
        }
    }
    std::size_t size() const
    {
        std::size_t n = 0;
        for (const Among& w : words_) n += std::size_t(std::popcount(w.which));
        return n;
    }

private:
    std::span<const Among> words_;
};
/// Soil around a cluster, as records.
class SoilList {
public:
    /// `record`: of every point of owned particles and ghosts together; none: the points are the records.
    SoilList(std::span<const Among> words, const Index* record) : points_(words), record_(record) {}
    template <class Visit> KUZURE_INLINE void for_each(Visit visit) const
    {
        if (record_) points_.for_each([&](std::size_t k) __attribute__((always_inline)) { visit(std::size_t(record_[k])); });
        else points_.for_each(visit);
    }
    std::size_t size() const { return points_.size(); }

private:
    PointSet points_;
    const Index* record_;
};
/// Wall points around a cluster, wall by wall.
class WallList {
public:
    /// For each wall {its number, words that follow} and those.
    explicit WallList(std::span<const Among> words) : words_(words) {}
    bool empty() const { return words_.empty(); }
    /// The first wall, and whether it is the only one; not of an empty list.
    int first_wall() const { return words_[0].first; }
    bool one_wall() const { return words_[0].which + 1 == words_.size(); }
    /// visit(wall, PointSet)
    template <class Visit> KUZURE_INLINE void for_each(Visit visit) const
    {
        for (auto left = words_; !left.empty(); left = left.subspan(1 + left[0].which))
            visit(int(left[0].first), PointSet(left.subspan(1, left[0].which)));
    }
    /// Points in all.
    std::size_t size() const
    {
        std::size_t n = 0;
        for_each([&](int, const PointSet& points) { n += points.size(); });
        return n;
    }

private:
    std::span<const Among> words_;
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
    SoilList soil(Index c) const { return {std::span(list_[c], std::size_t(n_soil_[c])), record_.empty() ? nullptr : record_.data()}; }
    WallList walls(Index c) const { return WallList(std::span(list_[c] + n_soil_[c], std::size_t(n_walls_[c]))); }

    /// What the last pruning pass kept of soil(c).
    std::span<const Index> pruned(Index c) const { return {pruned_[c], std::size_t(n_pruned_[c])}; }
    bool is_pruned(Index c) const { return n_pruned_[c] >= 0; }
    /// A thread's room for what it keeps of any one list; it then says of which and how many that is.
    Index* pruning_room();
    void keep_pruned(Index c, Index n);
    void forget_pruned(Index c) { n_pruned_[c] = -1; }
    /// All are about to be pruned anew.
    void forget_pruned();

    /// Clusters whose list has no ghost, and the others.
    std::span<const Index> interior() const { return interior_; }
    std::span<const Index> rim() const { return rim_; }
    std::size_t entries() const { return entries_; }
    std::size_t wall_entries() const { return wall_entries_; }
    /// Of the lists, and of what was kept in pruning.
    std::size_t bytes() const;
    std::size_t pruned_bytes() const;

private:
    int width_ = 0;
    Array<Index> first_;
    Array<std::int8_t> count_;
    Array<const Among*> list_; // soil, walls behind it
    Array<Index> n_soil_, n_walls_;
    Array<Index*> pruned_;
    Array<Index> n_pruned_;                           // < 0: not pruned yet
    Array<Index> record_;                             // of each point; none where there are no ghosts
    std::vector<Arena<Among>> store_;                 // one a thread
    struct alignas(64) PruningRoom : Arena<Index> {}; // of one thread, not on the cache line of another's
    std::vector<PruningRoom> pruned_store_;
    std::size_t longest_ = 0; // entries of the longest list
    std::vector<Index> interior_, rim_;
    std::size_t entries_ = 0, wall_entries_ = 0;
};

} // namespace kuzure
