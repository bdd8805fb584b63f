#include "solver/neighbours/columns.hpp"
#include "solver/core/ensure.hpp"
#include "solver/scene/scene.hpp"
#include <algorithm>
#include <fmt/format.h>
#include <limits>
#include <omp.h>

namespace kuzure {

Columns Columns::of(const Scene& s, Vector low)
{
    Columns c;
    c.origin = low;
    c.width_x = c.width_y = 2 * s.space.spacing;
    c.flat = s.dimensions == 2;
    // On a periodic axis a whole number of columns fills the period, so that an image keeps its neighbours' order.
    const auto fit = [&](double lo, double hi, double& origin, double& width) {
        const double columns = std::max(1.0, std::floor((hi - lo) / width + 1e-9));
        origin = lo;
        width = (hi - lo) / columns;
    };
    if (s.space.periodic[0]) fit(s.space.low->x, s.space.high->x, c.origin.x, c.width_x);
    if (s.space.periodic[1]) fit(s.space.low->y, s.space.high->y, c.origin.y, c.width_y);
    return c;
}

namespace {

struct Height {
    double z;
    std::int64_t id;
    Index from;
    bool operator<(const Height& o) const { return z < o.z || (z == o.z && id < o.id); }
};

/// Columns keep their order from sort to sort but for a few neighbours: insertion is linear then.
void sort_heights(Height* begin, Height* end)
{
    std::ptrdiff_t moves = 0;
    const std::ptrdiff_t enough = 8 * (end - begin);
    for (Height* i = begin + 1; i < end; ++i) {
        const Height h = *i;
        Height* j = i;
        for (; j > begin && h < j[-1]; --j) *j = j[-1];
        *j = h;
        moves += i - j;
        if (moves > enough) return std::sort(begin, end);
    }
}

/// Turns counts of columns by thread into the indices where each thread's particles begin.
void begin_columns(std::vector<std::vector<Index>>& histogram, std::vector<Index>& start, std::size_t count)
{
    Index at = 0;
    for (std::size_t c = 0; c < count; ++c) {
        start[c] = at;
        for (auto& mine : histogram) {
            const Index here = mine[c];
            mine[c] = at;
            at += here;
        }
    }
    start[count] = at;
}

} // namespace

ColumnSort sort_into_columns(const Columns& columns, const double* x, const double* y, const double* z, const std::int64_t* id, Index n)
{
    ColumnSort s;
    s.order.resize(n);
    if (n == 0) {
        s.start.assign(1, 0);
        return s;
    }
    Array<std::int32_t> cx(n), cy(n);
    std::int32_t x0 = std::numeric_limits<std::int32_t>::max(), x1 = -x0, y0 = x0, y1 = -x0;
#pragma omp parallel for schedule(static) reduction(min : x0, y0) reduction(max : x1, y1)
    for (Index i = 0; i < n; ++i) {
        cx[i] = columns.x_of(x[i]), cy[i] = columns.y_of(y[i]);
        x0 = std::min(x0, cx[i]), x1 = std::max(x1, cx[i]), y0 = std::min(y0, cy[i]), y1 = std::max(y1, cy[i]);
    }
    const double n_columns = (double(x1) - x0 + 1) * (double(y1) - y0 + 1);
    if (n_columns > 1e8)
        throw NumbersFailed(fmt::format("the soil has spread over {:.3g} columns of {:.3g} m: a particle flew off. Remedy: a smaller "
                                        "step (time.step or accuracy.cfl), more viscosity, or a box (space.low, space.high)",
                                        n_columns, columns.width_x));
    s.x0 = x0, s.y0 = y0, s.nx = x1 - x0 + 1, s.ny = y1 - y0 + 1;
    const std::size_t count = std::size_t(s.nx) * s.ny;

    // Counting sort by column. Each thread counts a contiguous share, so the sort is stable.
    const int threads = n > 20000 ? omp_get_max_threads() : 1;
    std::vector<std::vector<Index>> histogram(threads);
    Array<Height> heights(n);
    s.start.assign(count + 1, 0);
#pragma omp parallel num_threads(threads)
    {
        const int t = omp_get_thread_num();
        auto& mine = histogram[t];
        mine.assign(count, 0);
        const Index begin = Index(std::int64_t(n) * t / threads), end = Index(std::int64_t(n) * (t + 1) / threads);
        for (Index i = begin; i < end; ++i) {
            cx[i] = (cy[i] - y0) * s.nx + (cx[i] - x0);
            ++mine[cx[i]];
        }
#pragma omp barrier
#pragma omp single
        begin_columns(histogram, s.start, count);
        for (Index i = begin; i < end; ++i) heights[mine[cx[i]]++] = {z[i], id[i], i};
#pragma omp barrier
#pragma omp for schedule(dynamic, 64)
        for (std::int64_t c = 0; c < std::int64_t(count); ++c) {
            sort_heights(heights.data() + s.start[c], heights.data() + s.start[c + 1]);
            for (Index k = s.start[c]; k < s.start[c + 1]; ++k) s.order[k] = heights[k].from;
        }
    }
    return s;
}

} // namespace kuzure
