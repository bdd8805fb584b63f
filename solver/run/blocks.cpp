#include "solver/run/blocks.hpp"
#include "solver/core/ensure.hpp"
#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <iterator>
#include <limits>
#include <numeric>

namespace kuzure {

Vector low_corner(const scene::Filling& f, const Scene& s)
{
    const double half = 0.5 * s.space.spacing;
    const auto& b = f.soil_bounds();
    return {b.low.x - half, s.dimensions == 3 ? b.low.y - half : -half, b.low.z - half};
}

Vector period(const Scene& s) { return s.space.low && s.space.high ? *s.space.high - *s.space.low : Vector{1, 1, 1}; }

BlockSpace block_space(const Scene& s, const scene::Filling& f, int ranks, int per_rank)
{
    const double dx = s.space.spacing;
    const double particles = double(f.soil_count()) / (double(ranks) * per_rank);
    // Whole spacings: blocks then hold the same number of lattice points. A thousand times more where nothing is cut.
    double edge = std::max(3.0, std::floor(s.dimensions == 3 ? std::cbrt(particles) : std::sqrt(particles))) * dx;
    if (ranks == 1) edge = 1e3 * edge;
    Vector size{edge, edge, edge}, origin = low_corner(f, s);
    const auto fit = [&](int axis, double lo, double hi, double& e, double& o) {
        if (!s.space.periodic[axis]) return;
        e = (hi - lo) / std::max(1.0, std::floor((hi - lo) / e));
        o = lo;
    };
    if (s.space.low) {
        const Vector lo = *s.space.low, hi = *s.space.high;
        fit(0, lo.x, hi.x, size.x, origin.x), fit(1, lo.y, hi.y, size.y, origin.y), fit(2, lo.z, hi.z, size.z, origin.z);
    }
    return {origin, size, s.space.periodic, s.space.low.value_or(Vector{}), period(s)};
}

scene::Box box_of(const BlockSpace& space, const Block& b, double margin)
{
    const auto low = [&](int a) { return space.face(a, b[a]) - margin; };
    const auto high = [&](int a) { return space.face(a, b[a] + 1) + margin; };
    return {{low(0), low(1), low(2)}, {high(0), high(1), high(2)}};
}

// ---- counting -------------------------------------------------------------------------------------------------------
namespace {

/// Points in cells as wide as the support, to count neighbours of a few others.
class Cells {
public:
    Cells(const std::vector<Vector>& points, double support) : support_(support)
    {
        Bounds all = Bounds::none();
        for (const Vector& x : points) all.add(x);
        if (all.empty()) return;
        for (int a = 0; a < 3; ++a) low_[a] = all.low[a], n_[a] = 1 + int((all.high[a] - all.low[a]) / support);
        first_.assign(std::size_t(n_[0]) * n_[1] * n_[2] + 1, 0);
        for (const Vector& x : points) ++first_[cell(x) + 1];
        std::partial_sum(first_.begin(), first_.end(), first_.begin());
        x_.resize(points.size());
        auto next = first_;
        for (const Vector& x : points) x_[next[cell(x)]++] = x;
    }
    /// Points closer than the support, the point itself among them if it is one of them.
    std::int64_t near(Vector x) const
    {
        if (x_.empty()) return 0;
        const double at[3] = {x.x, x.y, x.z}, support2 = support_ * support_;
        int from[3], to[3];
        for (int a = 0; a < 3; ++a) {
            const int k = int(std::floor((at[a] - low_[a]) / support_));
            from[a] = std::max(0, k - 1), to[a] = std::min(n_[a] - 1, k + 1);
            if (from[a] > to[a]) return 0;
        }
        std::int64_t n = 0;
        for (int i = from[0]; i <= to[0]; ++i)
            for (int j = from[1]; j <= to[1]; ++j) {
                const std::size_t line = (std::size_t(i) * n_[1] + j) * n_[2];
                for (std::size_t k = first_[line + from[2]]; k < first_[line + to[2] + 1]; ++k) {
                    const Vector d = x_[k] - x;
                    n += dot(d, d) < support2;
                }
            }
        return n;
    }

private:
    std::size_t cell(Vector x) const
    {
        const double at[3] = {x.x, x.y, x.z};
        std::size_t c = 0;
        for (int a = 0; a < 3; ++a) c = c * n_[a] + std::size_t(std::min(n_[a] - 1, int((at[a] - low_[a]) / support_)));
        return c;
    }
    double support_, low_[3] = {0, 0, 0};
    int n_[3] = {1, 1, 1};
    std::vector<std::size_t> first_;
    std::vector<Vector> x_;
};

} // namespace

BlockSoil::BlockSoil(const Scene& scene, const scene::Filling& filling, const BlockSpace& space)
    : scene_(scene), filling_(filling), space_(space)
{
}

template <class Visit> void BlockSoil::around(const Block& b, double reach, Visit visit) const
{
    int r[3];
    for (int a = 0; a < 3; ++a) r[a] = a == 1 && scene_.dimensions == 2 ? 0 : int(std::ceil(reach / space_.size()[a] * (1 - 1e-12)));
    Block d;
    for (d[0] = -r[0]; d[0] <= r[0]; ++d[0])
        for (d[1] = -r[1]; d[1] <= r[1]; ++d[1])
            for (d[2] = -r[2]; d[2] <= r[2]; ++d[2]) {
                const Block there{b[0] + d[0], b[1] + d[1], b[2] + d[2]}, home = space_.wrapped(there);
                std::array<std::int8_t, 3> period_shift{};
                for (int a = 0; a < 3; ++a)
                    if (space_.period()[a]) period_shift[a] = std::int8_t((there[a] - home[a]) / space_.period()[a]);
                visit(home, d, period_shift);
            }
}

bool BlockSoil::next_block_holds(double reach) const
{
    for (int a = 0; a < 3; ++a)
        if (!(a == 1 && scene_.dimensions == 2) && reach > space_.size()[a]) return false;
    return true;
}

StepWork BlockSoil::count(const Block& b) const
{
    std::vector<Vector> mine, theirs, walls, some;
    points(b, mine);
    StepWork w;
    w.particles = std::int64_t(mine.size());
    if (mine.empty()) return w;
    Bounds box = Bounds::none();
    for (const Vector& x : mine) box.add(x);
    const double support = scene_.support();
    const auto length = space_.period_length();
    around(b, support, [&](const Block& home, const Block&, const std::array<std::int8_t, 3>& period_shift) {
        some.clear();
        points(home, some);
        const Vector shift{period_shift[0] * length[0], period_shift[1] * length[1], period_shift[2] * length[2]};
        const double none[3] = {0, 0, 0};
        for (const Vector& x : some)
            if (squared_distance(x + shift, none, box) < support * support) theirs.push_back(x + shift);
    });
    const auto turn = [&](int a) { return space_.period()[a] ? 1 : 0; };
    for (int i = -turn(0); i <= turn(0); ++i)
        for (int j = -turn(1); j <= turn(1); ++j)
            for (int k = -turn(2); k <= turn(2); ++k) {
                const Vector shift{i * length[0], j * length[1], k * length[2]}, margin{support, support, support};
                const Vector low = Vector{box.low[0], box.low[1], box.low[2]} - margin - shift;
                const Vector high = Vector{box.high[0], box.high[1], box.high[2]} + margin - shift;
                filling_.for_each_wall_in({low, high}, [&](std::int64_t, Vector x, int) { walls.push_back(x + shift); });
            }
    const Cells soil(theirs, support), wall(walls, support);
    for (const Vector& x : mine) w.soil_pairs += soil.near(x) - 1, w.wall_pairs += wall.near(x);
    return w;
}

StepWork BlockSoil::work(const Block& b) const
{
    const std::string like = next_block_holds(scene_.support()) ? pattern_key(b) : std::string();
    if (like.empty()) return count(b);
    {
        const std::lock_guard lock(mutex_);
        if (const auto known = work_of_.find(like); known != work_of_.end()) return known->second;
    }
    const StepWork w = count(b);
    const std::lock_guard lock(mutex_);
    return work_of_[like] = w;
}

/// A block near another, as that sees it: where its soil is at home, across which periods, and the way to it.
struct BlockSoil::Sight {
    Block home, way;
    int owner;
    std::array<std::int8_t, 3> period_shift;
};

/// Counts the particles of one block that are near the soil of some others.
class BlockSoil::NearCounts {
public:
    NearCounts(const BlockSoil& soil, const Block& b, double safe)
        : soil_(soil), block_(b), reach2_(safe * safe), pattern_(soil.next_block_holds(safe) ? soil.pattern_key(b) : std::string())
    {
    }
    std::int64_t near(std::span<const Sight> sights)
    {
        std::string key;
        if (!pattern_.empty()) {
            std::uint32_t mask = 0;
            for (const Sight& s : sights) mask |= 1u << ((s.way[0] + 1) * 9 + (s.way[1] + 1) * 3 + s.way[2] + 1);
            key = fmt::format("{}|{}", mask, pattern_);
            const std::lock_guard lock(soil_.mutex_);
            if (const auto known = soil_.known_counts_.find(key); known != soil_.known_counts_.end()) return known->second;
        }
        if (points_.empty()) soil_.points(block_, points_);
        find_boxes(sights);
        const double none[3] = {0, 0, 0};
        std::int64_t n = 0;
        for (const Vector& x : points_)
            n += std::ranges::any_of(sights, [&](const Sight& s) { return squared_distance(x, none, boxes_.at(s.way)) <= reach2_; });
        if (!key.empty()) {
            const std::lock_guard lock(soil_.mutex_);
            soil_.known_counts_[key] = n;
        }
        return n;
    }

private:
    void find_boxes(std::span<const Sight> sights)
    {
        const auto length = soil_.space_.period_length();
        std::vector<Vector> some;
        for (const Sight& s : sights) {
            if (boxes_.contains(s.way)) continue;
            Bounds box = Bounds::none();
            some.clear();
            soil_.points(s.home, some);
            for (const Vector& x : some)
                box.add(x + Vector{s.period_shift[0] * length[0], s.period_shift[1] * length[1], s.period_shift[2] * length[2]});
            boxes_[s.way] = box;
        }
    }

    const BlockSoil& soil_;
    const Block& block_;
    double reach2_;
    std::string pattern_; // blocks of this pattern have the same counts; empty where that is not so
    std::vector<Vector> points_;
    std::map<Block, Bounds> boxes_; // by way
};

BlockSoil::HaloDemand BlockSoil::halo_demand(const Block& b, int mine, const std::function<int(const Block&)>& owner_of, double reach) const
{
    std::vector<Sight> around_me;
    const auto length = space_.period_length();
    double extent = 0;
    for (int a = 0; a < 3; ++a)
        if (space_.period()[a]) extent = std::max({extent, std::abs(space_.period_low()[a]), std::abs(length[a])});
    const double safe = halo_reach(reach, extent);
    around(b, safe, [&](const Block& home, const Block& way, const std::array<std::int8_t, 3>& period_shift) {
        const int owner = owner_of(home);
        if (owner < 0 || (owner == mine && period_shift == std::array<std::int8_t, 3>{})) return;
        around_me.push_back({home, way, owner, period_shift});
    });
    HaloDemand result;
    if (around_me.empty()) return result;
    std::ranges::stable_sort(around_me, {}, [](const Sight& s) { return std::pair(s.owner, s.period_shift); });

    NearCounts counts(*this, b, safe);
    for (std::size_t from = 0, to; from < around_me.size(); from = to) {
        const Sight& first = around_me[from];
        for (to = from; to < around_me.size() && around_me[to].owner == first.owner && around_me[to].period_shift == first.period_shift;)
            ++to;
        const std::int64_t n = counts.near(std::span(around_me).subspan(from, to - from));
        if (n > 0) result.by.push_back({first.owner, first.period_shift, n});
    }
    result.seen = counts.near(around_me);
    return result;
}

// ---- the soil of the start ------------------------------------------------------------------------------------------
std::vector<Block> StartSoil::blocks() const
{
    // Body by body: what lies between bodies far apart is no block.
    const auto& b = filling_.soil_bounds();
    const Block least = space_.block_of(b.low), most = space_.block_of(b.high);
    std::vector<Block> all;
    for (const auto& body : scene_.bodies) {
        const scene::Box box = scene::bounds(body.shape);
        const auto corner = [&](Vector x) { return space_.block_of({x.x, scene_.dimensions == 3 ? x.y : b.low.y, x.z}); };
        const auto inside = [&](Vector x) {
            return Vector{std::clamp(x.x, b.low.x, b.high.x), std::clamp(x.y, b.low.y, b.high.y), std::clamp(x.z, b.low.z, b.high.z)};
        };
        Block lo = corner(inside(box.low)), hi = corner(inside(box.high)), at;
        for (int a = 0; a < 3; ++a) {
            // Across a period the corners may have been exchanged.
            if (lo[a] > hi[a]) lo[a] = least[a], hi[a] = most[a];
        }
        for (at[0] = lo[0]; at[0] <= hi[0]; ++at[0])
            for (at[1] = lo[1]; at[1] <= hi[1]; ++at[1])
                for (at[2] = lo[2]; at[2] <= hi[2]; ++at[2]) all.push_back(at);
    }
    std::sort(all.begin(), all.end());
    all.erase(std::unique(all.begin(), all.end()), all.end());
    return all;
}

void StartSoil::points(const Block& b, std::vector<Vector>& to) const
{
    filling_.for_each_soil_in(box_of(space_, b, 1e-6 * scene_.space.spacing), [&](std::int64_t, Vector x, int) {
        if (space_.block_of(x) == b) to.push_back(x);
    });
}

std::string StartSoil::pattern_key(const Block& b) const
{
    const double dx = scene_.space.spacing, close = 1e-6;
    const Vector edge{space_.size()[0], space_.size()[1], space_.size()[2]}, slack{close * dx, close * dx, close * dx};
    const auto length = space_.period_length();
    const auto turn = [&](int a) { return space_.period()[a] ? 1 : 0; };
    std::string text;
    for (int i = -turn(0); i <= turn(0); ++i)
        for (int j = -turn(1); j <= turn(1); ++j)
            for (int k = -turn(2); k <= turn(2); ++k) {
                const Vector shift{i * length[0], j * length[1], k * length[2]};
                scene::Box region = box_of(space_, b, 0);
                region.low = region.low - edge - slack - shift, region.high = region.high + edge + slack - shift;
                const auto grids = filling_.grids_in(region);
                if (!grids) return {};
                for (const auto& g : *grids) {
                    text += g.soil ? "s" : "w";
                    for (int a = 0; a < 3; ++a) {
                        if (a == 1 && scene_.dimensions == 2) continue;
                        const double move = a == 0 ? shift.x : a == 1 ? shift.y : shift.z, low = space_.face(a, b[a]);
                        // Points by block before, in and behind this one; where one lies on a face this is undefined.
                        int n[3] = {0, 0, 0};
                        for (std::int64_t q = 0; q < g.n[a]; ++q) {
                            const double in_blocks = (g.at(a, q) + move - low) / space_.size()[a], nearest = std::round(in_blocks);
                            if (std::abs(in_blocks - nearest) * space_.size()[a] < close * dx) return {};
                            const int side = int(std::floor(in_blocks)) + 1;
                            if (side >= 0 && side < 3) ++n[side];
                        }
                        fmt::format_to(std::back_inserter(text), " {} {} {} {}", std::llround((g.at(a, 0) + move - low) / (close * dx)),
                                       n[0], n[1], n[2]);
                    }
                }
            }
    return text;
}

// ---- the soil of a state --------------------------------------------------------------------------------------------
StateSoil::StateSoil(const Scene& scene, const scene::Filling& filling, const BlockSpace& space, std::vector<Vector> x)
    : BlockSoil(scene, filling, space)
{
    std::vector<std::pair<std::uint64_t, std::size_t>> order;
    order.reserve(x.size());
    for (std::size_t k = 0; k < x.size(); ++k) order.emplace_back(key_of(space.block_of(x[k])), k);
    std::ranges::sort(order);
    x_.reserve(x.size());
    for (std::size_t k = 0; k < order.size(); ++k) {
        if (k == 0 || order[k].first != order[k - 1].first) {
            const Block b = space.block_of(x[order[k].second]);
            index_.set(b, int(block_.size()));
            block_.push_back(b), first_.push_back(k);
        }
        x_.push_back(x[order[k].second]);
    }
    first_.push_back(x.size());
}

void StateSoil::points(const Block& b, std::vector<Vector>& to) const
{
    const int k = index_[b];
    if (k < 0) return;
    to.insert(to.end(), x_.begin() + std::ptrdiff_t(first_[k]), x_.begin() + std::ptrdiff_t(first_[k + 1]));
}

} // namespace kuzure
