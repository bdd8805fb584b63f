#pragma once
// What drawing_test.cpp holds of twenty generated scenes, and drawing_long_test.cpp of two hundred.
#include "solver/walls/surface.hpp"
#include "tests/validation/drawing.hpp"

namespace kuzure::validation {

/// Faces behind which each wall point lies, however the ground is cut.
inline void expect_same_faces(unsigned first, unsigned count)
{
    for (unsigned seed = first; seed < first + count; ++seed) {
        const Generated g = generate(seed);
        const auto scene = [&](const Drawing& d) {
            SceneText t;
            return scene_of(g, d, 1, t);
        };
        const Scene one = scene(g.drawings[0]), other = scene(g.drawings[1]);
        const WallSurface a(one), b(other);
        int wrong = 0;
        std::vector<Face> x, y;
        for (const auto& wall : one.walls) {
            const scene::Lattice lattice(wall.shape, spacing, g.dimensions);
            for (std::int64_t k = 0; k < lattice.size(); ++k) {
                const Vector at = lattice.position(k);
                a.faces(at, one.support(), x), b.faces(at, other.support(), y);
                bool same = x.size() == y.size();
                for (std::size_t f = 0; same && f < x.size(); ++f)
                    same = std::fabs(x[f].depth - y[f].depth) < 1e-9 * spacing && dot(x[f].normal, y[f].normal) > 1 - 1e-12 &&
                           one.walls[x[f].wall].surface == other.walls[y[f].wall].surface;
                if (same || ++wrong > 1) continue; // the first tells enough
                std::string faces;
                for (const auto* list : {&x, &y}) {
                    for (const Face& f : *list)
                        faces += fmt::format(" ({:.4g}, {:.4g}, {:.4g}) {:.12g}", f.normal.x, f.normal.y, f.normal.z, f.depth / spacing);
                    faces += list == &x ? " but cut" : "";
                }
                ADD_FAILURE() << g.what << ", at "
                              << fmt::format("({:.2f}, {:.2f}, {:.2f})", at.x / spacing, at.y / spacing, at.z / spacing)
                              << " spacings:" << faces;
            }
        }
        EXPECT_EQ(wrong, 0) << g.what;
    }
}

inline void expect_same_step(const std::string& name, unsigned first, unsigned count, const std::string& note = {})
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
    EXPECT_TRUE(c.at_most("accelerations and strain rates of a step, ground cut, shifted, mirrored, turned", worst, "of the largest", 1e-12,
                          {.note = note}));
}

inline void expect_same_motion(const std::string& name, unsigned first, unsigned count, const std::string& note = {})
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
    EXPECT_TRUE(c.at_most("places of an elastic block after 0.15 s, ground cut, shifted, mirrored, turned", worst.apart, "of its size",
                          1e-10, {.note = note}));
    const std::string first_order = smooth < 4e-3 && worst.given > -4e-3 ? "first order in the step: a tenth of it with cfl = 0.1" : note;
    EXPECT_TRUE(c.at_most("work of smooth walls on it", smooth, "of the largest energy", 1e-3, {.note = first_order, .achieved = 4e-3}));
    EXPECT_TRUE(c.at_least("work taken by walls of any surface", worst.given, "of the largest energy", -1e-3,
                           {.note = first_order, .achieved = -4e-3}));
}

} // namespace kuzure::validation
