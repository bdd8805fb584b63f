// The mass that fails, on the cells of the ground: its thickness, its bed, and what is doubtful about it.
#include "io/ground/loading.hpp"
#include "solver/scene/ring.hpp"
#include <algorithm>
#include <fmt/format.h>
#include <fmt/ranges.h>

namespace kuzure::io::ground {
namespace {

constexpr double none = std::numeric_limits<double>::quiet_NaN();
constexpr double most_doubtful_slope = 55; // deg: beyond it layers of particles lie close along the normal

class OnCells {
public:
    OnCells(const scene::Grid& heights, const std::string& crs, const Scene& scene, scene::Issues& issues)
        : dem_(heights), crs_(crs), scene_(scene), terrain_(*scene.terrain), issues_(issues)
    {
    }
    void work(Mass& m)
    {
        m.bed.assign(dem_.values.size(), none);
        check_outline(m);
        std::vector<double> t = thickness_of(m); // m, NaN: not known
        lay_bed(m, t);
        if (!m.release->thickness) end_at_outline(m, t);
        m.thickness = std::move(t);
        check_reach(m);
    }

private:
    std::vector<double> read(const Mass& m, const std::string& which, const std::string& file) const
    {
        return at_key(m.key + which, [&] { return onto(file, dem_, crs_); });
    }
    [[noreturn]] void refuse_gap(const Mass& m, const std::string& which, const std::string& file, int i, int j) const
    {
        throw Refused{m.key + which, fmt::format("{}: no data at {} under the release. Remedy: fill the hole (gdal_fillnodata.py, or "
                                                 "another file behind it in terrain.dem), or another outline",
                                                 file, cell_text(dem_, i, j))};
    }

    /// The outline must lie on ground, with a cell around it for the slopes.
    void check_outline(const Mass& m) const
    {
        if (m.rings.empty()) return;
        const scene::Release& r = *m.release;
        const Window w = extent_of(dem_);
        const double rim = 2 * dem_.cell;
        for (const auto& ring : m.rings)
            for (const auto& p : ring)
                if (p[0] < w.low_x + rim || p[0] > w.high_x - rim || p[1] < w.low_y + rim || p[1] > w.high_y - rim)
                    throw Refused{m.key + ".outline",
                                  fmt::format("{}: its corner ({:.10g}, {:.10g}) lies outside the ground, or within two cells of its "
                                              "edge ({}). Remedy: a larger window or elevation model, or another outline",
                                              r.outline, p[0], p[1], shown(w))};
    }

    std::vector<double> thickness_of(Mass& m)
    {
        const scene::Release& r = *m.release;
        if (r.thickness) return std::vector<double>(dem_.values.size(), *r.thickness);
        if (!r.thickness_map.empty()) return thickness_of_map(m);
        if (!r.surface.empty()) return thickness_above_surface(m);
        if (!r.before.empty()) return thickness_of_difference(m);
        std::vector<double> t(dem_.values.size(), none);
        dem_.for_each([&](int i, int j, std::size_t k) {
            for (const auto& o : m.outlines)
                if (std::isnan(t[k]) && scene::encloses(o.rings, dem_.x_of(i), dem_.y_of(j))) t[k] = *o.thickness;
        });
        return t;
    }

    std::vector<double> thickness_of_map(const Mass& m) const
    {
        const scene::Release& r = *m.release;
        const auto t = read(m, ".thickness_map", r.thickness_map);
        dem_.for_each([&](int i, int j, std::size_t k) {
            if (t[k] < 0)
                throw Refused{m.key + ".thickness_map", fmt::format("{}: expected thicknesses from 0, found {} m at {}. Remedy: "
                                                                    "gdal_calc.py, or declare it no data: gdal_translate -a_nodata {}",
                                                                    r.thickness_map, t[k], cell_text(dem_, i, j), t[k])};
        });
        return t;
    }

    /// The ground above a slip surface, which is the bed.
    std::vector<double> thickness_above_surface(Mass& m) const
    {
        const scene::Release& r = *m.release;
        const auto& z = dem_.values;
        std::vector<double> t(z.size(), none);
        const auto slip = read(m, ".surface", r.surface);
        dem_.for_each([&](int i, int j, std::size_t k) {
            if (m.rings.empty() ? std::isnan(slip[k]) : !in(m, i, j)) {
                if (!std::isnan(slip[k]) && !std::isnan(z[k])) t[k] = std::max(0.0, z[k] - slip[k]);
                return;
            }
            if (std::isnan(z[k])) refuse_gap(m, "", dem_files(scene_), i, j);
            if (std::isnan(slip[k])) refuse_gap(m, ".surface", r.surface, i, j);
            if (!m.rings.empty() && slip[k] > z[k] + 0.5)
                throw Refused{m.key + ".surface",
                              fmt::format("{}: the slip surface lies {:.2f} m above the ground at {}, inside the outline: a thickness "
                                          "below 0. Remedy: check the heights of both, or the outline",
                                          r.surface, slip[k] - z[k], cell_text(dem_, i, j))};
            t[k] = std::max(0.0, z[k] - slip[k]);
            if (t[k] > 0) m.bed[k] = slip[k];
        });
        return t;
    }

    /// The ground before over that after, which is the bed.
    std::vector<double> thickness_of_difference(Mass& m)
    {
        const scene::Release& r = *m.release;
        std::vector<double> t(dem_.values.size(), none);
        const auto before = read(m, ".before", r.before), after = read(m, ".after", r.after);
        double square = 0;
        std::size_t outside = 0;
        dem_.for_each([&](int i, int j, std::size_t k) {
            const bool here = !m.rings.empty() && in(m, i, j);
            if (here && std::isnan(before[k])) refuse_gap(m, ".before", r.before, i, j);
            if (here && std::isnan(after[k])) refuse_gap(m, ".after", r.after, i, j);
            if (std::isnan(before[k]) || std::isnan(after[k])) return;
            const double d = before[k] - after[k];
            if (!here && !m.rings.empty()) square += d * d, ++outside;
            t[k] = std::max(0.0, d);
            if (here || (m.rings.empty() && d > 0)) m.bed[k] = after[k];
        });
        if (outside > 0 && std::sqrt(square / double(outside)) > 0.5)
            warn(m.key, fmt::format("before and after differ by {:.2f} m (root mean square) outside the outline too: one is shifted, "
                                    "or has trees, or the deposit is in the window",
                                    std::sqrt(square / double(outside))));
        return t;
    }

    /// Inside, ground must be known; the bed follows.
    void lay_bed(Mass& m, const std::vector<double>& t)
    {
        const scene::Release& r = *m.release;
        const auto& z = dem_.values;
        double sum = 0, thickest = 0;
        std::size_t cells = 0;
        dem_.for_each([&](int i, int j, std::size_t k) {
            const bool here = m.rings.empty() ? t[k] > 0 : in(m, i, j);
            if (!here) return;
            if (std::isnan(z[k])) refuse_gap(m, "", dem_files(scene_), i, j);
            if (std::isnan(t[k]) && !r.thickness_map.empty()) refuse_gap(m, ".thickness_map", r.thickness_map, i, j);
            if (std::isnan(t[k]) || !(t[k] > 0)) return;
            sum += t[k], ++cells, thickest = std::max(thickest, t[k]);
            if (std::isnan(m.bed[k])) m.bed[k] = r.on_top ? z[k] : z[k] - t[k];
        });
        if (cells == 0)
            throw Refused{
                m.key, !r.before.empty() ? "the ground is nowhere lower after than before: no mass. Remedy: are before and after exchanged?"
                       : !r.surface.empty() ? "the slip surface is nowhere below the ground: no mass. Remedy: check the heights of both"
                                            : "no cell of the elevation model lies inside: no mass. Remedy: an elevation model with "
                                              "smaller cells, or a larger outline"};
        judge_size(m, sum, cells, thickest);
    }

    /// `sum` of the thicknesses (m) of so many cells.
    void judge_size(const Mass& m, double sum, std::size_t cells, double thickest)
    {
        const double a = double(cells) * dem_.cell * dem_.cell, volume = sum * dem_.cell * dem_.cell, mean = volume / a;
        if (const double share = volume / std::pow(a, 1.5); share < 0.03 || share > 0.5)
            warn(m.key, fmt::format("a volume of {:.3g} m^3 on {:.3g} m^2 (mean thickness {:.2f} m) is {:.1f} % of area^1.5, where slides "
                                    "have 3 to 50 %: check outline and thickness",
                                    volume, a, mean, 100 * share));
        if (dem_.cell > thickest)
            warn("terrain.dem",
                 fmt::format("its cells ({} m) are coarser than the release is thick ({:.2f} m at most)", dem_.cell, thickest));
        if (mean < 6 * scene_.space.spacing)
            warn("space.spacing",
                 fmt::format(
                     "the release is {:.1f} layers of particles thick on average; below 6 its reach is rough. Remedy: spacing = {:.2g}",
                     mean / scene_.space.spacing, mean / 6));
    }

    void end_at_outline(const Mass& m, std::vector<double>& t) const
    {
        if (m.rings.empty()) {
            for (double& x : t)
                if (std::isnan(x)) x = 0; // a cell's thickness counts for its area
        } else {
            // Soil stands within the outline, as thick as there: a raster that ends with it would taper off half a cell before.
            dem_.for_each([&](int i, int j, std::size_t k) {
                if (t[k] == 0 && !in(m, i, j)) t[k] = none;
            });
            extend(t, 1 + std::max(1, int(scene_.space.spacing / dem_.cell)));
        }
    }

    void warn(const std::string& key, const std::string& text) { issues_.push_back({scene::Severity::Warning, key, text, ""}); }

    bool in(const Mass& m, int i, int j) const { return m.rings.empty() || scene::encloses(m.rings, dem_.x_of(i), dem_.y_of(j)); }

    /// Gives cells without a value that touch cells with one the mean of these, some times over: an outline runs between cells.
    void extend(std::vector<double>& values, int times) const
    {
        for (int t = 0; t < times; ++t) {
            auto next = values;
            dem_.for_each([&](int i, int j, std::size_t k) {
                if (!std::isnan(values[k])) return;
                double sum = 0;
                int n = 0;
                for (int b = std::max(j - 1, 0); b <= std::min(j + 1, dem_.rows - 1); ++b)
                    for (int a = std::max(i - 1, 0); a <= std::min(i + 1, dem_.columns - 1); ++a) {
                        const double x = values[std::size_t(b) * std::size_t(dem_.columns) + std::size_t(a)];
                        if (!std::isnan(x)) sum += x, ++n;
                    }
                if (n > 0) next[k] = sum / n;
            });
            values = std::move(next);
        }
    }

    /// What is missing or steep where the mass may go.
    void check_reach(const Mass& m)
    {
        double top = -std::numeric_limits<double>::infinity();
        const auto& z = dem_.values;
        dem_.for_each([&](int, int, std::size_t k) {
            if (!std::isnan(m.bed[k])) top = std::max(top, z[k]);
        });
        double low = top;
        for (const double h : z)
            if (h < low) low = h;
        const double way = (top - low) / reach_slope; // the farthest that soil can come
        const Window& b = m.box;
        std::size_t missing = 0, steep = 0, known = 0;
        double steepest = 0;
        int steepest_i = 0, steepest_j = 0;
        const auto distance = [&](double x, double y) {
            return std::hypot(std::max({b.low_x - x, x - b.high_x, 0.0}), std::max({b.low_y - y, y - b.high_y, 0.0}));
        };
        dem_.for_each([&](int i, int j, std::size_t k) {
            const double d = distance(dem_.x_of(i), dem_.y_of(j));
            if (d > way) return;
            if (std::isnan(z[k])) {
                ++missing;
                return;
            }
            if (z[k] > top - reach_slope * d) return;
            ++known;
            if (i == 0 || j == 0 || i + 1 == dem_.columns || j + 1 == dem_.rows) return;
            const double sx = (dem_.at(i + 1, j) - dem_.at(i - 1, j)) / (2 * dem_.cell),
                         sy = (dem_.at(i, j + 1) - dem_.at(i, j - 1)) / (2 * dem_.cell);
            const double slope = std::atan(std::hypot(sx, sy)) * 180 / std::numbers::pi;
            if (slope > most_doubtful_slope) ++steep;
            if (slope > steepest) steepest = slope, steepest_i = i, steepest_j = j;
        });
        // Beyond the edge: cells of the circle that are not there. Only where the ground at the edge can be reached.
        const auto edge_reached = [&](int i, int j) {
            return !std::isnan(dem_.at(i, j)) && dem_.at(i, j) <= top - reach_slope * distance(dem_.x_of(i), dem_.y_of(j));
        };
        std::size_t edge = 0, edges = 0;
        for (int i = 0; i < dem_.columns; ++i) edges += 2, edge += edge_reached(i, 0), edge += edge_reached(i, dem_.rows - 1);
        for (int j = 0; j < dem_.rows; ++j) edges += 2, edge += edge_reached(0, j), edge += edge_reached(dem_.columns - 1, j);
        if (missing > 0)
            warn("terrain.dem", fmt::format("{:.2g} % of the cells within reach of {} (the line of 11 degrees from its top) have no data: "
                                            "soil that comes there is lost",
                                            100 * double(missing) / double(missing + known), m.key));
        if (edge > 0)
            warn(terrain_.window ? "terrain.window" : "terrain.dem",
                 fmt::format("the edge of the ground lies within reach of {} (the line of 11 degrees from its top): {:.2g} % of its edge "
                             "can be passed. Remedy: a larger {}",
                             m.key, 100 * double(edge) / double(edges), terrain_.window ? "window" : "elevation model"));
        if (steep > 0)
            warn("terrain.dem",
                 fmt::format(
                     "{} cells within reach of {} are steeper than {} degrees, up to {:.0f} at {}: layers of particles lie close there",
                     steep, m.key, most_doubtful_slope, steepest, cell_text(dem_, steepest_i, steepest_j)));
    }

    const scene::Grid& dem_; // map coordinates
    const std::string& crs_;
    const Scene& scene_;
    const scene::Terrain& terrain_;
    scene::Issues& issues_;
};

} // namespace

void thickness_and_bed(Mass& m, const scene::Grid& heights, const std::string& crs, const Scene& scene, scene::Issues& issues)
{
    OnCells(heights, crs, scene, issues).work(m);
}

} // namespace kuzure::io::ground
