// Stress "at rest": the soil above a point on generated stacks, against closed forms, and what is told to be no equilibrium.
#include "solver/run/initial_stress.hpp"
#include "solver/scene/check.hpp"
#include <algorithm>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <limits>
#include <random>

using namespace kuzure;
using namespace kuzure::scene;
using ::testing::HasSubstr;

namespace {

const double far = std::numeric_limits<double>::infinity(), g = 9.81;
const Box everywhere{{-far, -far, -far}, {far, far, far}};

Scene made(double spacing, std::vector<Shape> bodies, int dimensions = 2, std::vector<Shape> walls = {})
{
    Scene s;
    s.dimensions = dimensions;
    s.space.spacing = spacing;
    s.time.end = 1;
    Soil soil;
    soil.name = "s", soil.density = 1850, soil.young = 2e6, soil.poisson = 0.3, soil.friction_angle = 0.43;
    s.soils = {soil};
    for (auto& shape : bodies) s.bodies.push_back({0, shape, {}, scene::InitialStress::AtRest});
    for (auto& shape : walls) s.walls.push_back({shape});
    s.effects.gravity = Vector{0, 0, -g};
    return s;
}
/// Vertical stress (Pa, pressure positive) of every particle, by id.
std::vector<double> vertical(const Scene& s)
{
    const Filling filling(s);
    std::vector<Material> soils;
    for (const auto& soil : s.soils) soils.push_back(Material::from(soil));
    const kuzure::InitialStress at_rest(s, filling, soils);
    std::vector<double> all;
    filling.for_each_soil_in(
        everywhere, [&](std::int64_t, Vector x, int body) { all.push_back(-at_rest(x, body, s.bodies[std::size_t(body)].soil).zz); });
    return all;
}
double greatest(const Scene& s)
{
    const auto all = vertical(s);
    return *std::max_element(all.begin(), all.end());
}
std::string why(const Scene& s) { return no_closed_form(s, Filling(s)); }

} // namespace

// Layers of random soils, heights and sideways shifts, each within the one below it, at times in the air above it, in any order in the
// file: the weight above a point is that of what stands without a gap above it, by the part of its column that is covered.
TEST(AtRest, GeneratedStacksCarryWhatTouches)
{
    std::mt19937 random(18);
    const auto real = [&](double a, double b) { return std::uniform_real_distribution<double>(a, b)(random); };
    const auto whole = [&](int a, int b) { return std::uniform_int_distribution<int>(a, b)(random); };
    std::int64_t compared = 0, gaps = 0;
    for (int n = 0; n < 300; ++n) {
        const int dimensions = n % 3 ? 2 : 3;
        const double dx = std::array{0.1, 0.07, 0.25}[std::size_t(whole(0, 2))];
        const double away = whole(0, 3) ? 0 : std::round(4e6 / dx) * dx;
        Scene s = made(dx, {}, dimensions);
        s.soils.resize(3, s.soils[0]);
        s.soils[1].density = 1200, s.soils[2].density = 2400;
        struct Layer {
            Box box;
            double density;
            bool carried; // by the lowest one, without a gap
        };
        std::vector<Layer> layers;
        int nx = whole(8, 14), ny = dimensions == 3 ? whole(5, 7) : 3;
        double x = away + real(-1, 1), y = real(-1, 1), z = real(-1, 1);
        bool carried = true;
        std::vector<Body> bodies;
        for (int layer = 0; layer < whole(1, 5); ++layer) {
            if (layer > 0) {
                const int less_x = whole(0, 2), less_y = dimensions == 3 ? whole(0, 1) : 0;
                // Any shift that keeps it within the layer below; as often none, or half a spacing.
                const auto shift = [&](int less) {
                    return less == 0 ? 0 : std::array{0.0, 0.5, real(0, less)}[std::size_t(whole(0, 2))] * dx;
                };
                x += shift(less_x), y += shift(less_y);
                nx -= less_x, ny -= less_y;
                if (whole(0, 3) == 0) {
                    z += std::array{0.2 * dx, dx, real(0.01, 5) * dx}[std::size_t(whole(0, 2))];
                    carried = false, ++gaps;
                }
            }
            const double top = z + whole(1, 5) * dx;
            const int soil = whole(0, 2);
            const Box box{{x, y, z}, {x + nx * dx, y + ny * dx, top}};
            layers.push_back({box, s.soils[std::size_t(soil)].density, carried});
            bodies.push_back({soil, box, {}, scene::InitialStress::AtRest});
            z = top;
        }
        std::shuffle(bodies.begin(), bodies.end(), random);
        s.bodies = bodies;
        const Filling filling(s);
        const Columns columns(s, filling);
        filling.for_each_soil_in(everywhere, [&](std::int64_t, Vector p, int body) {
            if (!std::get<Box>(s.bodies[std::size_t(body)].shape).low.z || whole(0, 3)) return; // a quarter of them
            const auto covered = [&](double at, double low, double high) {
                return std::max(0.0, std::min(at + 0.5 * dx, high) - std::max(at - 0.5 * dx, low)) / dx;
            };
            double mass = 0, last = 0;
            bool on = false;
            for (const auto& l : layers) {
                if (on && std::abs(l.box.low.z - last) > 1e-6 * dx) break;
                const bool own = !on && p.z > l.box.low.z && p.z < l.box.high.z;
                on = on || own;
                if (!on) continue;
                const double part =
                    covered(p.x, l.box.low.x, l.box.high.x) * (dimensions == 3 ? covered(p.y, l.box.low.y, l.box.high.y) : 1);
                mass += part * l.density * (l.box.high.z - std::max(p.z, l.box.low.z));
                last = l.box.high.z;
            }
            ASSERT_NEAR(columns.above(p, body).mass, mass, 2e-6 * mass) << "stack " << n << " at " << p.x << " " << p.y << " " << p.z;
            ++compared;
        });
    }
    EXPECT_GT(compared, 5'000);
    EXPECT_GT(gaps, 100);
}

// As reported: half a lattice aside, the upper layer counted nothing; a boulder in the air counted in full.
TEST(AtRest, ReportedScenes)
{
    const auto shifted = made(0.1, {Box{{0, 0, 0}, {2, 0, 1}}, Box{{0.05, 0, 1}, {1.95, 0, 2}}});
    EXPECT_NEAR(greatest(shifted), 1850 * g * 1.95, 1e-3);
    EXPECT_EQ(why(shifted), "");
    auto boulder = made(0.1, {Box{{0, 0, 0}, {3, 0, 1}}, Box{{1, 0, 3}, {2, 0, 4}}});
    boulder.bodies[1].stress = scene::InitialStress::None;
    const auto stress = vertical(boulder);
    EXPECT_NEAR(*std::max_element(stress.begin(), stress.begin() + 300), 1850 * g * 0.95, 1e-3);
    EXPECT_EQ(why(boulder), "");
    // A body of another start that lies on the ground weighs on it.
    boulder.bodies[1].shape = Box{{1, 0, 1}, {2, 0, 2}};
    EXPECT_NEAR(greatest(boulder), 1850 * g * 1.95, 1e-3);
}

// The same bank whole, split into polygons and into boxes: every point the same stress.
TEST(AtRest, SplitGroundHasTheStressOfTheWhole)
{
    const auto rectangle = [](double x1, double z1, double x2, double z2) { return Polygon{{{x1, z1}, {x2, z1}, {x2, z2}, {x1, z2}}, {}}; };
    const auto sorted = [](const Scene& s) {
        const auto stress = vertical(s);
        std::vector<std::array<double, 3>> all;
        Filling(s).for_each_soil_in(everywhere, [&](std::int64_t id, Vector x, int) {
            all.push_back({std::round(x.x * 1e6), std::round(x.z * 1e6), stress[std::size_t(id)]});
        });
        std::sort(all.begin(), all.end());
        return all;
    };
    const auto whole = sorted(made(0.1, {rectangle(0, 0, 2, 2)}));
    ASSERT_EQ(whole.size(), 400u);
    for (const auto& pieces : {std::vector<Shape>{rectangle(0, 0, 2, 0.7), rectangle(0, 0.7, 1.05, 2), rectangle(1.05, 0.7, 2, 2)},
                               std::vector<Shape>{Polygon{{{0, 0}, {2, 0}, {2, 2}}, {}}, Polygon{{{0, 0}, {2, 2}, {0, 2}}, {}}},
                               std::vector<Shape>{Box{{0, 0, 0}, {2, 0, 1}}, Box{{0, 0, 1}, {0.6, 0, 2}}, rectangle(0.6, 1, 2, 2)}}) {
        const auto split = sorted(made(0.1, pieces));
        ASSERT_EQ(split.size(), whole.size());
        for (std::size_t k = 0; k < whole.size(); ++k) {
            EXPECT_EQ(split[k][0], whole[k][0]);
            EXPECT_EQ(split[k][1], whole[k][1]);
            EXPECT_NEAR(split[k][2], whole[k][2], 1e-6 * 1850 * g * 2);
        }
    }
}

// Weight is neither lost nor made: what a shifted layer puts on the columns below adds up to its own.
TEST(AtRest, WeightOfAShiftedLayerAddsUp)
{
    for (const double shift : {0.0, 0.013, 0.05, 0.0731}) {
        auto s = made(0.1, {Box{{0, 0, 0}, {1, 0.6, 0.2}}, Box{{0.2 + shift, 0.1 + shift, 0.2}, {0.7 + shift, 0.4 + shift, 0.5}}}, 3);
        const Filling filling(s);
        const Columns columns(s, filling);
        double sum = 0;
        filling.for_each_soil_in({{-far, -far, -far}, {far, far, 0.1}},
                                 [&](std::int64_t, Vector x, int body) { sum += columns.above(x, body).mass * 0.01; });
        EXPECT_NEAR(sum, 1850 * (1 * 0.6 * 0.15 + 0.5 * 0.3 * 0.3), 1e-6 * sum) << shift;
    }
}

// Through no wall: a ceiling between two soils carries the upper one, and soil below it begins there.
TEST(AtRest, WallsStopTheColumn)
{
    const auto s = made(0.1, {Box{{0, 0, 0}, {1, 0, 1}}, Box{{0, 0, 1.3}, {1, 0, 2}}}, 2, {Box{{-0.5, 0, 1}, {1.5, 0, 1.3}}});
    EXPECT_NEAR(greatest(s), 1850 * g * 0.95, 1e-3);
    const auto polygon = made(0.1, {Box{{0, 0, 0}, {1, 0, 1}}, Polygon{{{0, 1.12}, {1, 1.12}, {1, 2}, {0, 2}}, {}}}, 2,
                              {Polygon{{{-0.5, 1}, {1.5, 1}, {1.5, 1.12}, {-0.5, 1.12}}, {}}});
    EXPECT_NEAR(greatest(polygon), 1850 * g * 0.95, 1e-3);
    // Thinner than a spacing, its one row of particles on its lower or just below its upper face.
    for (const double low : {1.05, 1.01}) {
        const auto rectangle = [](double z1, double z2) { return Polygon{{{0, z1}, {1, z1}, {1, z2}, {0, z2}}, {}}; };
        const auto thin = made(0.1, {Box{{0, 0, low - 1}, {1, 0, low}}, rectangle(low + 0.05, 3)}, 2, {rectangle(low, low + 0.05)});
        EXPECT_NEAR(greatest(thin), 1850 * g * (3 - 1.15 + 0.05 - 0.05), 1e-3) << low;
        EXPECT_NEAR(vertical(thin)[0], 1850 * g * 0.95, 1e-3) << low;
    }
}

TEST(AtRest, ColumnsCrossAPeriod)
{
    // The lattice of polygons is 0.03 m aside of the box's, so one column is carried half on the other side.
    auto s = made(0.1, {Box{{0.03, 0, 0}, {1.03, 0, 1}}, Polygon{{{0.03, 1}, {1.03, 1}, {1.03, 2}, {0.03, 2}}, {}}});
    s.space.low = Vector{0.03, 0, -1}, s.space.high = Vector{1.03, 0, 3};
    s.space.periodic[0] = true;
    const auto stress = vertical(s);
    for (int k = 0; k < 10; ++k) EXPECT_NEAR(stress[std::size_t(k)], 1850 * g * 1.95, 1e-3) << k;
    EXPECT_EQ(why(s), "");
    s.space.periodic[0] = false;
    EXPECT_LT(vertical(s)[9], 1850 * g * 1.9);
}

TEST(AtRest, ShapesOnOtherLatticesStandOnEachOther)
{
    // Polygons have their particles where the common lattice has them: up to half a spacing before or behind a box's face.
    for (const double face : {0.92, 0.95, 0.99, 1.0, 1.04, 1.051, 1.08}) {
        const auto s = made(0.1, {Box{{0, 0, face - 1}, {1, 0, face}}, Polygon{{{0, face}, {1, face}, {1, face + 1}, {0, face + 1}}, {}},
                                  Box{{0.03, 0, face + 1}, {0.93, 0, face + 1.5}}});
        EXPECT_NEAR(greatest(s), 1850 * g * (0.95 + 1 + 0.5), 1e-3) << face;
        EXPECT_EQ(why(s), "") << face;
    }
}

TEST(AtRest, WhereNoClosedFormHoldsItIsSaid)
{
    const Box ground{{0, 0, 0}, {2, 0, 1}};
    const auto polygon = [](std::vector<std::array<double, 2>> points) { return Polygon{std::move(points), {}}; };
    EXPECT_EQ(why(made(0.1, {ground})), "");
    EXPECT_EQ(why(made(0.1, {ground, Box{{3, 0, 0}, {4, 0, 2}}})), "");           // two grounds that do not touch
    EXPECT_EQ(why(made(0.1, {polygon({{0, 0}, {2, 0.5}, {2, 2}, {0, 2}})})), ""); // level on a slanted floor
    EXPECT_EQ(why(made(0.1, {Cylinder{{0, 0, 0}, 0.5, 1}}, 3)), "");
    const auto slope = HasSubstr("the ground is not level: its surface is at z = ");
    EXPECT_THAT(why(made(0.1, {polygon({{0, 0}, {3, 0}, {1, 1}, {0, 1}})})), slope);
    EXPECT_THAT(why(made(0.1, {polygon({{0, 0}, {3, 0}, {3, 1.12}, {0, 1}})})), slope);
    EXPECT_THAT(why(made(0.1, {Box{{0, 0, 0}, {1, 0, 1}}, Box{{1, 0, 0}, {2, 0, 2}}})), slope);
    EXPECT_THAT(why(made(0.1, {ground, Box{{0, 0, 1}, {1, 0, 1.5}}})), slope); // a terrace
    EXPECT_THAT(why(made(0.1, {Box{{0, 0, 0}, {1, 1, 1}}, Box{{0, 1, 0}, {1, 2, 1.3}}}, 3)), slope);
    EXPECT_THAT(why(made(0.1, {Sphere{{0, 0, 0}, 0.5}}, 3)), slope);
    // A step where a period ends.
    auto terraced = made(0.1, {Box{{0, 0, 0}, {1, 0, 1}}, Box{{1.3, 0, 0}, {2, 0, 0.5}}});
    EXPECT_EQ(why(terraced), "");
    terraced.space.low = Vector{0, 0, -1}, terraced.space.high = Vector{2, 0, 3}, terraced.space.periodic[0] = true;
    EXPECT_THAT(why(terraced), slope);
    auto s = made(0.1, {ground});
    s.effects.pore_pressure = PorePressure{{{0, 1}, {2, 1}}, 1000};
    EXPECT_EQ(why(s), "");
    s.effects.pore_pressure->table[1][1] = 0.5;
    EXPECT_EQ(why(s), "the water table is not level");
    s.effects.pore_pressure.reset();
    s.effects.gravity = Vector{1, 0, -9.81};
    EXPECT_EQ(why(s), "gravity does not point straight down");
    s.bodies[0].stress = scene::InitialStress::None;
    EXPECT_EQ(why(s), "");
}

// As reported, the shifted layer stands half a spacing off the walls at its sides; the one below leans on them.
TEST(AtRest, AWallBesideItHasToBeReached)
{
    const Box lower{{0, 0, 0}, {2, 0, 1}};
    const std::vector<Shape> sides{Box{{-0.4, 0, 0}, {0, 0, 3}}, Box{{2, 0, 0}, {2.4, 0, 3}}};
    const auto off = HasSubstr("m off the wall beside it");
    EXPECT_THAT(why(made(0.1, {lower, Box{{0.05, 0, 1}, {1.95, 0, 2}}}, 2, sides)),
                AllOf(off, HasSubstr("at (0.1, 0, 1.05) the soil stands 0.05")));
    EXPECT_THAT(why(made(0.1, {lower}, 2, {Box{{2.03, 0, 0}, {2.43, 0, 3}}})), off);
    EXPECT_EQ(why(made(0.1, {lower, Box{{0, 0, 1}, {2, 0, 2}}}, 2, sides)), "");
    EXPECT_EQ(why(made(0.1, {lower}, 2, {Box{{-1, 0, -0.4}, {3, 0, 0}}})), "");   // a gate's
    EXPECT_EQ(why(made(0.1, {lower}, 2, {Box{{2.15, 0, 0}, {2.55, 0, 1}}})), ""); // further off than a spacing: a gate's too
    // Leaning on polygons, whose particles and those of the soil may be up to 1.5 spacings apart.
    for (const double face : {2.0, 2.001, 2.04, 2.05, 2.051, 2.099}) {
        const auto rectangle = [](double x1, double x2, double z2) { return Polygon{{{x1, 0}, {x2, 0}, {x2, z2}, {x1, z2}}, {}}; };
        EXPECT_EQ(why(made(0.1, {Box{{face - 1, 0, 0}, {face, 0, 1}}}, 2, {rectangle(face, 3, 2)})), "") << face;
        EXPECT_EQ(why(made(0.1, {rectangle(1, face, 1)}, 2, {Box{{face, 0, 0}, {face + 0.4, 0, 2}}})), "") << face;
        EXPECT_THAT(why(made(0.1, {rectangle(1, face, 1)}, 2, {Box{{face + 0.06, 0, 0}, {face + 0.46, 0, 2}}})), off) << face;
    }
    EXPECT_THAT(why(made(0.1, {Box{{0, 0, 0}, {1, 1, 1}}}, 3, {Box{{0, 1.04, 0}, {1, 1.44, 2}}})), off);
    EXPECT_EQ(why(made(0.1, {Box{{0, 0, 0}, {1, 1, 1}}}, 3, {Box{{0, 1, 0}, {1, 1.4, 2}}, Box{{0, 0, -0.4}, {1, 1, 0}}})), "");
}

TEST(AtRest, CheckSaysWhereItSettlesAndWhatThatTakes)
{
    const auto note = [](const Scene& s) {
        Issues issues;
        const auto made = check_and_fill(s, StepLimit::Enforce, issues);
        for (const auto& n : made.value().scene.notes)
            if (n.name == "settling") return n.why;
        return std::string();
    };
    auto s = made(0.1, {Polygon{{{0, 0}, {3, 0}, {1, 1}, {0, 1}}, {}}});
    s.soils[0].cone = Cone::PlaneStrain;
    EXPECT_THAT(note(s), AllOf(HasSubstr("the ground is not level"), HasSubstr("before t = 0, about")));
    s.bodies[0].shape = Box{{0, 0, 0}, {3, 0, 1}};
    EXPECT_EQ(note(s), "");
    s.effects.gravity = Vector{1, 0, -9};
    EXPECT_THAT(note(s), HasSubstr("gravity does not point straight down"));
}
