#include "solver/neighbours/lists.hpp"
#include "solver/core/ensure.hpp"
#include "solver/core/simd.hpp"
#include <algorithm>
#include <bit>
#include <limits>
#include <omp.h>

namespace kuzure {

void WallPoints::sort(const Columns& c)
{
    columns = sort_into_columns(c, x.data(), y.data(), z.data(), id.data(), Index(x.size()));
    const auto permute = [&](auto& v) {
        std::remove_reference_t<decltype(v)> w(v.size());
        for (std::size_t k = 0; k < v.size(); ++k) w[k] = v[columns.order[k]];
        v.swap(w);
    };
    permute(x), permute(y), permute(z), permute(id);
    columns.order = {};
}

void WallPoints::keep(const std::vector<bool>& wanted)
{
    const std::size_t n = x.size();
    Index kept = 0;
    std::size_t column = 0;
    for (std::size_t k = 0; k < n; ++k) {
        for (; column < columns.start.size() && std::size_t(columns.start[column]) <= k; ++column) columns.start[column] = kept;
        if (!wanted[k]) continue;
        x[kept] = x[k], y[kept] = y[k], z[kept] = z[k], id[kept] = id[k];
        ++kept;
    }
    for (; column < columns.start.size(); ++column) columns.start[column] = kept;
    for (auto* v : {&x, &y, &z}) v->resize(kept), v->shrink_to_fit();
    id.resize(kept);
}

std::size_t WallPoints::bytes() const
{
    return (x.capacity() + y.capacity() + z.capacity()) * sizeof(double) + id.capacity() * sizeof(std::int64_t) + columns.bytes();
}

namespace {

using Narrow = Native<float>;
constexpr int narrow = width<Narrow>;

/// Candidates in single precision, relative to a local origin, padded so that a full register may be read anywhere; the padding is far
/// away, and its square still a float.
struct Candidates {
    Array<float> x, y, z;
    std::int32_t x0 = 0, y0 = 0, nx = 0, ny = 0;
    std::vector<Index> start;

    void resize(Index n)
    {
        x.resize(n + narrow), y.resize(n + narrow), z.resize(n + narrow);
        for (Index k = n; k < n + narrow; ++k) x[k] = y[k] = z[k] = 1e18f;
    }
    std::pair<Index, Index> range(std::int32_t cx, std::int32_t cy) const
    {
        const std::int32_t a = cx - x0, b = cy - y0;
        if (a < 0 || b < 0 || a >= nx || b >= ny) return {0, 0};
        const std::size_t c = std::size_t(b) * nx + a;
        return {start[c], start[c + 1]};
    }
};

/// Two sets in the global order become one; the second set's records follow the first's. `record`: of each, none where the second set is.
Candidates merge(const SortedPoints& a, const SortedPoints& b, Vector origin, Array<Index>& record_of)
{
    Candidates m;
    if (b.n > 0) resize_anew(record_of, std::size_t(a.n) + std::size_t(b.n));
    else record_of = {};
    const auto &ca = *a.columns, &cb = *b.columns;
    const bool one = b.n == 0, other = a.n == 0;
    m.x0 = one ? ca.x0 : other ? cb.x0 : std::min(ca.x0, cb.x0);
    m.y0 = one ? ca.y0 : other ? cb.y0 : std::min(ca.y0, cb.y0);
    const auto x1 = one ? ca.x0 + ca.nx : other ? cb.x0 + cb.nx : std::max(ca.x0 + ca.nx, cb.x0 + cb.nx);
    const auto y1 = one ? ca.y0 + ca.ny : other ? cb.y0 + cb.ny : std::max(ca.y0 + ca.ny, cb.y0 + cb.ny);
    m.nx = x1 - m.x0, m.ny = y1 - m.y0;
    const std::size_t count = std::size_t(m.nx) * m.ny;
    m.start.resize(count + 1);
    m.start[0] = 0;
    for (std::size_t c = 0; c < count; ++c) {
        const auto cx = m.x0 + std::int32_t(c % m.nx), cy = m.y0 + std::int32_t(c / m.nx);
        const auto ra = ca.range(cx, cy), rb = cb.range(cx, cy);
        m.start[c + 1] = m.start[c] + (ra.second - ra.first) + (rb.second - rb.first);
    }
    m.resize(a.n + b.n);
    const auto put = [&](Index at, const SortedPoints& s, Index from, Index record) {
        m.x[at] = float(s.x[from] - origin.x), m.y[at] = float(s.y[from] - origin.y), m.z[at] = float(s.z[from] - origin.z);
        if (!record_of.empty()) record_of[at] = record;
    };
#pragma omp parallel for schedule(dynamic, 256)
    for (std::int64_t c = 0; c < std::int64_t(count); ++c) {
        const auto cx = m.x0 + std::int32_t(c % m.nx), cy = m.y0 + std::int32_t(c / m.nx);
        auto [i, i_end] = ca.range(cx, cy);
        auto [j, j_end] = cb.range(cx, cy);
        for (Index at = m.start[c]; at < m.start[c + 1]; ++at) {
            const bool first = j == j_end || (i < i_end && (a.z[i] < b.z[j] || (a.z[i] == b.z[j] && a.id[i] < b.id[j])));
            if (first) put(at, a, i, i), ++i;
            else put(at, b, j, a.n + j), ++j;
        }
    }
    return m;
}

Candidates of_walls(const WallPoints& w, Vector origin)
{
    Candidates m;
    m.x0 = w.columns.x0, m.y0 = w.columns.y0, m.nx = w.columns.nx, m.ny = w.columns.ny;
    m.start = w.columns.start;
    const Index n = Index(w.x.size());
    m.resize(n);
    for (Index k = 0; k < n; ++k) m.x[k] = float(w.x[k] - origin.x), m.y[k] = float(w.y[k] - origin.y), m.z[k] = float(w.z[k] - origin.z);
    return m;
}

/// The box around one cluster's particles, in single precision.
struct Cluster {
    float lo[3] = {1e30f, 1e30f, 1e30f}, hi[3] = {-1e30f, -1e30f, -1e30f};
    void add(const float (&p)[3])
    {
        for (int d = 0; d < 3; ++d) lo[d] = std::min(lo[d], p[d]), hi[d] = std::max(hi[d], p[d]);
    }
};

/// Writes a list: groups of candidates that follow each other, with a bit for each that is near.
class Writer {
public:
    explicit Writer(Among* to) : to_(to) {}
    void put(Index first, unsigned hits)
    {
        if (hits == 0) return;
        const unsigned ahead = unsigned(std::countr_zero(hits));
        const Index at = first + Index(ahead);
        hits >>= ahead;
        if (open_ && at - to_->first < 32) {
            const std::uint64_t all = std::uint64_t(hits) << (at - to_->first);
            to_->which |= std::uint32_t(all);
            if (const auto rest = std::uint32_t(all >> 32); rest != 0) begin(to_->first + 32, rest);
        } else begin(at, hits);
    }
    /// No group of now goes on after this.
    void close() { to_ += std::exchange(open_, false); }
    Among* end() const { return to_; }

private:
    void begin(Index first, std::uint32_t which)
    {
        close();
        const int ahead = std::countr_zero(which);
        *to_ = {first + ahead, which >> ahead};
        open_ = true;
    }
    Among* to_;
    bool open_ = false;
};

/// Candidates of one set for the clusters of one column, from the lowest to the highest: where their heights begin and end in each column
/// around moves on by little from one cluster to the next.
class Finder {
public:
    Finder(const Candidates& m, const Columns& columns, Vector origin, float reach)
        : m_(m), columns_(columns), origin_(origin), reach_(reach)
    {
    }

    /// Around column (cx, cy), by rx and ry columns.
    void enter(std::int32_t cx, std::int32_t cy, std::int32_t rx, std::int32_t ry)
    {
        around_.clear();
        for (std::int32_t y = cy - ry; y <= cy + ry; ++y)
            for (std::int32_t x = cx - rx; x <= cx + rx; ++x) {
                const auto [begin, end] = m_.range(x, y);
                if (begin == end) continue;
                // left and front carry single-precision rounding: reach has the slack for it
                const float left = float(columns_.origin.x + x * columns_.width_x - origin_.x);
                const float front = columns_.flat ? -1e30f : float(columns_.origin.y + y * columns_.width_y - origin_.y);
                around_.push_back({left, left + float(columns_.width_x), front, columns_.flat ? 1e30f : front + float(columns_.width_y),
                                   begin, end, begin, begin, false});
            }
    }
    /// Where candidates are for a cluster; returns how many words they take at most.
    std::size_t seek(const Cluster& c)
    {
        const float* z = m_.z.data();
        std::size_t words = 0;
        for (Around& a : around_) {
            // distance of the cluster's box to the column, in plan
            const float dx = std::max({0.f, a.left - c.hi[0], c.lo[0] - a.right}),
                        dy = std::max({0.f, a.front - c.hi[1], c.lo[1] - a.back});
            const float height2 = reach_ * reach_ - dx * dx - dy * dy;
            a.near = height2 > 0;
            if (!a.near) continue;
            const float dz = std::sqrt(height2), low = c.lo[2] - dz, high = c.hi[2] + dz;
            while (a.begin > a.first && z[a.begin - 1] >= low) --a.begin;
            while (a.begin < a.last && z[a.begin] < low) ++a.begin;
            a.end = std::max(a.end, a.begin);
            while (a.end > a.begin && z[a.end - 1] > high) --a.end;
            while (a.end < a.last && z[a.end] <= high) ++a.end;
            words += std::size_t(a.end - a.begin + 31) / 32;
        }
        return words;
    }
    /// Writes those within reach of the box of that cluster, in the global order.
    Among* write(const Cluster& c, Among* out) const
    {
        const Narrow zero(0.0f), reach2(reach_ * reach_);
        const Narrow x0(c.lo[0]), x1(c.hi[0]), y0(c.lo[1]), y1(c.hi[1]), z0(c.lo[2]), z1(c.hi[2]);
        Writer to(out);
        for (const Around& a : around_) {
            if (!a.near) continue;
            for (Index q = a.begin; q < a.end; q += narrow) {
                const Narrow x = load<Narrow>(&m_.x[q]), y = load<Narrow>(&m_.y[q]), h = load<Narrow>(&m_.z[q]);
                const Narrow ax = max(max(x0 - x, x - x1), zero), ay = max(max(y0 - y, y - y1), zero), az = max(max(z0 - h, h - z1), zero);
                unsigned hits = bits(less(fma(az, az, fma(ay, ay, ax * ax)), reach2));
                if (a.end - q < narrow) hits &= (1u << (a.end - q)) - 1;
                to.put(q, hits);
            }
            to.close();
        }
        return to.end();
    }

private:
    struct Around { // a column: its sides in plan, all its candidates, and those of the last cluster's heights
        float left, right, front, back;
        Index first, last, begin, end;
        bool near;
    };
    const Candidates& m_;
    const Columns& columns_;
    Vector origin_;
    float reach_;
    std::vector<Around> around_;
};

/// The first cluster of each column, and the end: clusters are runs of `width` particles.
std::vector<Index> cluster_starts(const ColumnSort& cols, int width)
{
    const std::size_t n_columns = std::size_t(cols.nx) * cols.ny;
    std::vector<Index> start(n_columns + 1, 0);
    for (std::size_t c = 0; c < n_columns; ++c) start[c + 1] = start[c] + (cols.start[c + 1] - cols.start[c] + width - 1) / width;
    return start;
}

/// Where single-precision coordinates begin, the middle of the owned soil, and the reach (m) with slack for their rounding.
struct Frame {
    Vector origin;
    float reach;
};
Frame frame_of(const SortedPoints& owned, double reach)
{
    Vector lo{1e300, 1e300, 1e300}, hi{-1e300, -1e300, -1e300};
    for (Index i = 0; i < owned.n; ++i) {
        lo = {std::min(lo.x, owned.x[i]), std::min(lo.y, owned.y[i]), std::min(lo.z, owned.z[i])};
        hi = {std::max(hi.x, owned.x[i]), std::max(hi.y, owned.y[i]), std::max(hi.z, owned.z[i])};
    }
    const double extent = owned.n ? std::max({hi.x - lo.x, hi.y - lo.y, hi.z - lo.z}) + 4 * reach : 0;
    return {owned.n ? 0.5 * (lo + hi) : Vector{}, float(reach * (1 + 1e-6) + 1e-6 * extent)};
}

Cluster cluster_of(const SortedPoints& p, Index begin, Index end, Vector origin)
{
    Cluster c;
    for (Index k = begin; k < end; ++k) c.add({float(p.x[k] - origin.x), float(p.y[k] - origin.y), float(p.z[k] - origin.z)});
    return c;
}

/// What one thread finds.
class ThreadLists {
public:
    ThreadLists(const Candidates& soil, const std::vector<Candidates>& walls, const Columns& columns, const Frame& frame)
    {
        finders_.emplace_back(soil, columns, frame.origin, frame.reach);
        for (const auto& w : walls) finders_.emplace_back(w, columns, frame.origin, frame.reach);
    }
    void enter(std::int32_t cx, std::int32_t cy, std::int32_t rx, std::int32_t ry)
    {
        for (auto& f : finders_) f.enter(cx, cy, rx, ry);
    }
    struct Found {
        const Among* list;
        Index soil, walls; // words
        std::size_t soil_points, wall_points;
    };
    /// Soil, and for each wall near by {its number, words} and those.
    Found find(const Cluster& c, Arena<Among>& store)
    {
        std::size_t words = 0;
        for (auto& f : finders_) words += 1 + f.seek(c);
        Among* const list = store.room(words);
        Among* const soil_end = finders_[0].write(c, list);
        Among* end = soil_end;
        std::size_t wall_points = 0;
        for (std::size_t w = 0; w + 1 < finders_.size(); ++w) {
            Among* const head = end;
            end = finders_[w + 1].write(c, head + 1);
            if (end == head + 1) {
                end = head;
                continue;
            }
            *head = {Index(w), std::uint32_t(end - head - 1)};
            wall_points += PointSet({head + 1, end}).size();
        }
        store.take(std::size_t(end - list));
        return {list, Index(soil_end - list), Index(end - soil_end), PointSet({list, soil_end}).size(), wall_points};
    }

private:
    std::vector<Finder> finders_;
};

} // namespace

void ClusterLists::build(const Columns& columns, const SortedPoints& owned, const SortedPoints& ghosts, std::span<const WallPoints> walls,
                         double reach, int width)
{
    ensure(width >= 1 && width <= 16, "a cluster holds 1 to 16 particles");
    width_ = width;
    const auto& cols = *owned.columns;
    const std::size_t n_columns = std::size_t(cols.nx) * cols.ny;
    const std::vector<Index> cluster_start = cluster_starts(cols, width);
    const Index n = cluster_start[n_columns];
    for (auto* a : {&first_, &n_soil_, &n_walls_, &n_pruned_}) resize_anew(*a, std::size_t(n));
    resize_anew(count_, std::size_t(n)), resize_anew(list_, std::size_t(n)), resize_anew(pruned_, std::size_t(n));

    const Frame frame = frame_of(owned, reach);
    const Candidates soil = merge(owned, ghosts, frame.origin, record_);
    std::vector<Candidates> wall_points;
    for (const auto& w : walls) wall_points.push_back(of_walls(w, frame.origin));

    const int threads = omp_get_max_threads();
    store_.resize(threads), pruned_store_.resize(std::max(threads, omp_get_num_procs()));
    std::size_t words = 0;
    for (const auto& s : store_) words += s.taken();
    for (auto& s : store_) s.clear((words ? words : std::size_t(n) * 21) / std::size_t(threads));
    std::vector<std::uint8_t> has_ghost(n, 0);
    std::size_t entries = 0, wall_entries = 0, longest = 0;
    const auto column_reach = [&](double w) { return std::int32_t(std::ceil(frame.reach / w)); };
    const std::int32_t rx = column_reach(columns.width_x), ry = columns.flat ? 0 : column_reach(columns.width_y);

#pragma omp parallel num_threads(threads) reduction(+ : entries, wall_entries) reduction(max : longest)
    {
        const int t = omp_get_thread_num();
        ThreadLists lists(soil, wall_points, columns, frame);
#pragma omp for schedule(dynamic, 16)
        for (std::int64_t column = 0; column < std::int64_t(n_columns); ++column) {
            Index begin = cols.start[column];
            const Index end = cols.start[column + 1];
            if (begin == end) continue;
            lists.enter(cols.x0 + std::int32_t(column % cols.nx), cols.y0 + std::int32_t(column / cols.nx), rx, ry);
            for (Index c = cluster_start[column]; c < cluster_start[column + 1]; ++c, begin += width) {
                const int members = int(std::min<Index>(width, end - begin));
                const auto found = lists.find(cluster_of(owned, begin, begin + members, frame.origin), store_[t]);
                first_[c] = begin, count_[c] = std::int8_t(members);
                list_[c] = found.list, n_soil_[c] = found.soil, n_walls_[c] = found.walls;
                entries += found.soil_points, wall_entries += found.wall_points;
                longest = std::max(longest, found.soil_points);
                if (!record_.empty()) this->soil(c).for_each([&](Index j) { has_ghost[c] |= j >= std::size_t(owned.n); });
            }
        }
    }
    entries_ = entries, wall_entries_ = wall_entries, longest_ = longest;
    const auto rim = std::size_t(std::ranges::count(has_ghost, 1));
    resize_anew(rim_, rim), resize_anew(interior_, std::size_t(n) - rim);
    rim_.clear(), interior_.clear();
    for (Index c = 0; c < n; ++c) (has_ghost[c] ? rim_ : interior_).push_back(c);
    forget_pruned();
}

void ClusterLists::forget_pruned()
{
    std::fill(n_pruned_.begin(), n_pruned_.end(), -1);
    std::size_t kept = 0;
    for (const auto& s : pruned_store_) kept += s.taken();
    for (auto& s : pruned_store_) s.clear((kept ? kept : entries_ / 2) / store_.size());
}

Index* ClusterLists::pruning_room()
{
    const auto t = std::size_t(omp_get_thread_num());
    ensure(t < pruned_store_.size(), "lists are pruned by more threads than made them");
    return pruned_store_[t].room(longest_);
}

void ClusterLists::keep_pruned(Index c, Index n)
{
    auto& store = pruned_store_[std::size_t(omp_get_thread_num())];
    Index* const fresh = store.room(longest_);
    if (n <= n_pruned_[c]) std::copy_n(fresh, n, pruned_[c]); // pruned once more: there is room where it was
    else pruned_[c] = fresh, store.take(std::size_t(n));
    n_pruned_[c] = n;
}

std::size_t ClusterLists::bytes() const
{
    std::size_t b = first_.capacity() * (3 * sizeof(Index) + 1 + sizeof(void*)) + record_.capacity() * sizeof(Index);
    for (const auto& s : store_) b += s.bytes();
    return b + (interior_.capacity() + rim_.capacity()) * sizeof(Index);
}

std::size_t ClusterLists::pruned_bytes() const
{
    std::size_t b = first_.capacity() * (sizeof(Index) + sizeof(void*));
    for (const auto& s : pruned_store_) b += s.bytes();
    return b;
}

} // namespace kuzure
