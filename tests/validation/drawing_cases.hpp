#pragma once
// What drawing_test.cpp holds of twenty generated scenes, and drawing_long_test.cpp of two hundred.
#include "solver/walls/surface.hpp"
#include "tests/validation/drawing.hpp"

namespace kuzure::validation {

/// A wall point, put back into the first drawing, and the faces that it lies behind; of equally near ones the order does not count.
struct Backed {
    Vector x;
    std::vector<Face> faces;
};
inline std::vector<Backed> backed(const Generated& g, const Drawing& d)
{
    SceneText t;
    const Scene scene = scene_of(g, d, 1, t);
    const WallSurface surface(scene);
    const auto back = [&](Vector a) {
        if (d.motion.turned) a = {a.y, -a.x, a.z};
        return d.motion.mirrored ? Vector{-a.x, a.y, a.z} : a;
    };
    const auto place = [](const Vector& x) { // to a thousandth of a spacing, in order
        const auto whole = [](double a) { return std::llround(1e3 * a / spacing); };
        return std::array{whole(x.z), whole(x.y), whole(x.x)};
    };
    std::vector<Backed> points;
    for (const auto& wall : scene.walls) {
        const scene::Lattice lattice(wall.shape, spacing, g.dimensions);
        for (std::int64_t k = 0; k < lattice.size(); ++k) {
            const Vector at = lattice.position(k);
            Backed p{back(at), {}};
            if (g.periodic) p.x.x -= std::floor(p.x.x / g.width + 1e-9) * g.width;
            surface.faces(at, scene.support(), p.faces);
            for (Face& f : p.faces) f.normal = back(f.normal), f.wall = int(scene.walls[std::size_t(f.wall)].surface);
            std::ranges::sort(p.faces, {}, [&](const Face& f) { return std::pair(place({0, 0, f.depth}), place(f.normal)); });
            points.push_back(p);
        }
    }
    std::ranges::sort(points, {}, [&](const Backed& p) { return place(p.x); });
    return points;
}
/// Which wall points there are and the faces behind which each lies, however the ground is cut, shifted, mirrored, turned.
inline void expect_same_faces(unsigned first, unsigned count)
{
    const auto told = [](const Backed& p) {
        std::string text = fmt::format("({:.2f}, {:.2f}, {:.2f}) spacings:", p.x.x / spacing, p.x.y / spacing, p.x.z / spacing);
        for (const Face& f : p.faces)
            text += fmt::format(" ({:.4g}, {:.4g}, {:.4g}) {:.12g}", f.normal.x, f.normal.y, f.normal.z, f.depth / spacing);
        return text;
    };
    const auto alike = [](const Face& a, const Face& b) {
        return std::fabs(a.depth - b.depth) < 1e-9 * spacing && dot(a.normal, b.normal) > 1 - 1e-12 && a.wall == b.wall;
    };
    for (unsigned seed = first; seed < first + count; ++seed) {
        const Generated g = generate(seed);
        const auto measure = backed(g, g.drawings[0]);
        for (std::size_t q = 1; q < g.drawings.size(); ++q) {
            const auto other = backed(g, g.drawings[q]);
            ASSERT_EQ(other.size(), measure.size()) << g.what << ", " << g.drawings[q].what;
            int wrong = 0;
            for (std::size_t k = 0; k < measure.size(); ++k) {
                const Backed &a = measure[k], &b = other[k];
                if (length(a.x - b.x) < 1e-9 * spacing && std::ranges::equal(a.faces, b.faces, alike)) continue;
                if (++wrong == 1) // the first tells enough
                    ADD_FAILURE() << g.what << ", " << g.drawings[q].what << ": " << told(a) << " but " << told(b);
            }
            EXPECT_EQ(wrong, 0) << g.what << ", " << g.drawings[q].what;
        }
    }
}

inline void expect_same_step(const std::string& name, unsigned first, unsigned count)
{
    Case c(name);
    double worst = 0;
    for (unsigned seed = first; seed < first + count; ++seed) {
        const Generated g = generate(seed);
        Draw draw(seed + 1000);
        const Placed soil = soil_beside(g, draw);
        const OneStep off = one_step(g, soil);
        worst = std::max(worst, off.largest());
        EXPECT_LT(off.largest(), 1e-12) << g.what << ", " << soil.x.size() << " particles, " << g.drawings[1].walls.size() << " pieces, "
                                        << g.drawings[2].what << ": a " << off.acceleration << " later " << off.later_acceleration
                                        << " strain rate " << off.strain_rate;
    }
    EXPECT_TRUE(
        c.at_most("accelerations and strain rates of a step, ground cut, shifted, mirrored, turned", worst, "of the largest", 1e-12));
}

inline void expect_same_motion(const std::string& name, unsigned first, unsigned count)
{
    Case c(name);
    Motions worst;
    double smooth = 0;
    for (unsigned seed = first; seed < first + count; ++seed) {
        const Generated g = generate(seed);
        Draw draw(seed + 2000);
        const Placed soil = block_above(g, draw);
        SceneText t;
        t.young = 2e6;
        const Motions m = motion(g, soil, 0.15, t);
        EXPECT_LT(m.apart, 1e-10) << g.what << ", " << soil.x.size() << " particles, " << g.drawings[1].walls.size() << " pieces, "
                                  << g.drawings[2].what;
        EXPECT_GT(m.moved, 1e-4) << g.what;
        worst.apart = std::max(worst.apart, m.apart), worst.given = std::min(worst.given, m.given);
        if (g.surface == scene::Surface::Smooth && !g.mixed) smooth = std::max({smooth, m.taken, -m.given});
    }
    EXPECT_TRUE(
        c.at_most("places of an elastic block after 0.15 s, ground cut, shifted, mirrored, turned", worst.apart, "of its size", 1e-10));
    const std::string second_order = "second order in the step: a hundredth of it with cfl = 0.1";
    EXPECT_TRUE(c.at_most("work of smooth walls on it", smooth, "of the largest energy", 1e-3, {.note = second_order, .achieved = 1e-2}));
    EXPECT_TRUE(c.at_least("work taken by walls of any surface", worst.given, "of the largest energy", -1e-3,
                           {.note = second_order, .achieved = -4e-3}));
}

} // namespace kuzure::validation
