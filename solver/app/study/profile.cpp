#include "solver/app/study/profile.hpp"
#include "solver/app/report/record.hpp"
#include "solver/scene/material.hpp"
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

namespace kuzure::study {
namespace {

/// Vertical axis (x, y) that all bodies are round about, if there is one.
std::optional<std::array<double, 2>> common_axis(const Scene& s)
{
    std::optional<std::array<double, 2>> axis;
    for (const auto& body : s.bodies) {
        std::array<double, 2> here;
        if (const auto* c = std::get_if<scene::Cylinder>(&body.shape)) here = {c->base.x, c->base.y};
        else if (const auto* b = std::get_if<scene::Sphere>(&body.shape)) here = {b->center.x, b->center.y};
        else return {};
        if (axis && *axis != here) return {};
        axis = here;
    }
    return axis;
}

/// Positions per window: the profile is smooth over a window, so this many show all of it.
const int samples_per_window = 8;

} // namespace

double Profile::operator()(double x) const
{
    if (at.empty() || x < at.front() || x > at.back()) return 0;
    const auto k =
        std::size_t(std::clamp<std::ptrdiff_t>(std::upper_bound(at.begin(), at.end(), x) - at.begin(), 1, std::ptrdiff_t(at.size()) - 1));
    const double share = at[k] == at[k - 1] ? 0 : (x - at[k - 1]) / (at[k] - at[k - 1]);
    return height[k - 1] + share * (height[k] - height[k - 1]);
}

double Profile::runout(double grain) const
{
    // The outermost point where the curve falls through the height, from the outside in.
    const auto crossing = [&](bool outwards) -> std::optional<double> {
        const auto n = std::ptrdiff_t(at.size());
        for (std::ptrdiff_t j = 0; j < n; ++j) {
            const auto k = std::size_t(outwards ? n - 1 - j : j);
            if (height[k] < grain) continue;
            const auto outer = std::size_t(outwards ? std::min<std::ptrdiff_t>(std::ptrdiff_t(k) + 1, n - 1)
                                                    : std::max<std::ptrdiff_t>(std::ptrdiff_t(k) - 1, 0));
            if (outer == k) return at[k];
            return at[k] + (at[outer] - at[k]) * (height[k] - grain) / (height[k] - height[outer]);
        }
        return {};
    };
    const auto high = crossing(true), low = crossing(false);
    if (!high || !low) return 0;
    const double right = *high - start_high, left = spread == Spread::Radial ? 0 : start_low - *low;
    const double further = std::max(left, right);
    double sum = 0;
    int sides = 0;
    for (const double way : {left, right})
        if (way >= 0.5 * further) sum += way, ++sides;
    return sides ? sum / sides : further;
}

Profile measure_profile(const Scene& s, const io::SoilSnapshot& soil, double window)
{
    const scene::Filling filling(s);
    const scene::Box start = filling.soil_bounds();
    const double dx = s.space.spacing, half = 0.5 * dx;
    const auto axis = s.dimensions == 3 ? common_axis(s) : std::nullopt;
    Profile p;
    p.spread = s.dimensions == 2 ? Spread::Plane : axis ? Spread::Radial : Spread::Band;
    if (soil.position.empty()) return p;
    p.start_low = start.low.x - half, p.start_high = start.high.x + half;

    // A particle is a square (2-D), an upright slab of its volume; its position along the spread is smeared over one spacing.
    std::vector<double> along;
    double across = 1; // m, width of what is measured at right angles to the spread
    if (p.spread == Spread::Radial) {
        p.start_low = 0, p.start_high = 0.5 * (p.start_high - p.start_low);
        // the body's own radius: the lattice's bounds may stop short of it
        for (const auto& body : s.bodies)
            if (const auto* c = std::get_if<scene::Cylinder>(&body.shape)) p.start_high = std::max(p.start_high, c->radius);
        for (const Vector& x : soil.position) along.push_back(std::hypot(x.x - (*axis)[0], x.y - (*axis)[1]));
    } else if (p.spread == Spread::Band) {
        const double middle = 0.5 * (start.low.y + start.high.y), width = start.high.y - start.low.y + dx;
        across = 0.5 * width;
        for (const Vector& x : soil.position)
            if (std::fabs(x.y - middle) < 0.5 * across) along.push_back(x.x);
        if (along.empty()) return p;
    } else {
        for (const Vector& x : soil.position) along.push_back(x.x);
    }
    std::sort(along.begin(), along.end());
    // Volume up to a point: particles count from half a spacing before their centre to half a spacing behind, linearly.
    std::vector<double> sums(along.size() + 1, 0);
    for (std::size_t i = 0; i < along.size(); ++i) sums[i + 1] = sums[i] + along[i];
    const auto count_below = [&](double x) {
        const auto whole = std::size_t(std::upper_bound(along.begin(), along.end(), x - half) - along.begin());
        const auto touched = std::size_t(std::lower_bound(along.begin(), along.end(), x + half) - along.begin());
        const double n = double(touched - whole);
        return double(whole) + (n * (x + half) - (sums[touched] - sums[whole])) / dx;
    };

    // Beside a wall, where the soil has not moved outwards, the window must not reach behind it.
    const bool radial = p.spread == Spread::Radial;
    const bool stays_low = radial || along.front() - half > p.start_low - 0.25 * window;
    const bool stays_high = !radial && along.back() + half < p.start_high + 0.25 * window;
    const double first = stays_low ? p.start_low : along.front() - window, last = stays_high ? p.start_high : along.back() + window;
    const double apart = window / samples_per_window;
    const auto n = std::size_t(std::ceil((last - first) / apart)) + 1;
    const double volume = s.particle_volume();
    for (std::size_t k = 0; k < n; ++k) {
        const double x = std::min(first + double(k) * apart, last);
        const double low = stays_low ? first : -HUGE_VAL, high = stays_high ? last : HUGE_VAL;
        const double a = std::clamp(x - 0.5 * window, low, std::max(low, high - window)), b = a + window;
        const double area = radial ? std::numbers::pi * (b * b - a * a) : window * across;
        p.at.push_back(x);
        p.height.push_back((count_below(b) - count_below(a)) * volume / area);
    }
    p.top = *std::max_element(p.height.begin(), p.height.end());
    return p;
}

double profile_distance(const Profile& a, const Profile& b)
{
    if (b.at.empty()) return std::nan("");
    // Equal areas count equally: away from an axis, rings grow.
    const auto weight = [&](double x) { return b.spread == Spread::Radial ? std::max(x, 0.0) : 1.0; };
    double difference = 0, size = 0;
    const auto add = [&](double x) {
        const double h = b(x), e = a(x) - h;
        difference += weight(x) * e * e, size += weight(x) * h * h;
    };
    const double apart = b.at.size() > 1 ? b.at[1] - b.at[0] : 1;
    for (const double x : b.at) add(x);
    if (!a.at.empty()) {
        for (double x = b.at.back() + apart; x <= a.at.back(); x += apart) add(x);
        for (double x = b.at.front() - apart; x >= a.at.front(); x -= apart) add(x);
    }
    return std::sqrt(difference / size);
}

std::vector<std::array<double, 2>> failure_line(const io::SoilSnapshot& s, double spacing, double limit)
{
    struct Grain {
        double x, moved;
    };
    std::map<std::int64_t, std::vector<Grain>> rows;
    for (std::size_t i = 0; i < s.displacement.size(); ++i) {
        const Vector u = s.displacement[i], start = s.position[i] - u;
        rows[std::llround(2 * start.z / spacing)].push_back({start.x, std::hypot(u.x, u.z)});
    }
    std::vector<std::array<double, 2>> line;
    for (auto& [twice, row] : rows) {
        std::sort(row.begin(), row.end(), [](const Grain& a, const Grain& b) { return a.x < b.x; });
        std::size_t moving = row.size(); // from here on all have moved
        while (moving > 0 && row[moving - 1].moved >= limit) --moving;
        if (moving == row.size()) continue;
        const double z = 0.5 * double(twice) * spacing;
        if (moving == 0) {
            line.push_back({row.front().x - 0.5 * spacing, z});
            continue;
        }
        const Grain &still = row[moving - 1], &gone = row[moving];
        line.push_back({still.x + (limit - still.moved) / (gone.moved - still.moved) * (gone.x - still.x), z});
    }
    return line;
}

AtRest measure_at_rest(const Scene& s, const io::SoilSnapshot& soil)
{
    if (s.bodies.size() != 1 || !s.effects.gravity || soil.stress.empty() || soil.displacement.empty())
        return {std::nan(""), std::nan(""), std::nan("")};
    const scene::Filling filling(s);
    const double half = 0.5 * s.space.spacing, top = filling.soil_bounds().high.z + half, bottom = filling.soil_bounds().low.z - half;
    const Material m = Material::from(s.soils[std::size_t(s.bodies[0].soil)]);
    const double weight = m.density * -s.effects.gravity->z, height = top - bottom;
    double e2 = 0, r2 = 0, way = 0;
    std::int64_t n = 0;
    for (std::size_t i = 0; i < soil.position.size(); ++i) {
        const double z = soil.position[i].z - soil.displacement[i].z, expected = -weight * (top - z), e = soil.stress[i].zz - expected;
        e2 += e * e, r2 += expected * expected;
        if (z > top - s.space.spacing) way -= soil.displacement[i].z, ++n;
    }
    const double modulus = m.density * m.c_p * m.c_p;
    // The top row's centre lies half a spacing below the top.
    const double depth = half;
    return {std::sqrt(e2 / r2), n ? way / double(n) : 0, weight * (height * height - depth * depth) / (2 * modulus)};
}

double greatest_speed(const io::Path& run, double of_steps)
{
    const auto history = report::read_table(io::read_text(run / "history.csv"));
    const auto column = history.find("max_speed");
    if (column != history.end())
        for (const double v : column->second) of_steps = std::max(of_steps, v);
    return of_steps;
}

} // namespace kuzure::study
