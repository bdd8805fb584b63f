// Both stages of every compiled staggered model against solver/kernels/staggered_by_the_book.hpp: in 3-D and 2-D, plain, in lanes and in
// mixed precision, far from walls and beside walls of every shape and surface, corners, seams and images across a period.
// Beyond 400 lines: one comparison, whose clouds, book and judgement belong together.
#include "solver/kernels/staggered_by_the_book.hpp"
#include "tests/unit/clouds.hpp"
#include "tests/unit/run_staggered.hpp"
#include <functional>
#include <gtest/gtest.h>

using namespace kuzure;
using namespace kuzure::measured;
using book::operator+;
using book::operator*;

namespace {

constexpr auto staggered = scene::Scheme::Staggered;
constexpr double damping = 0.7; // 1/s

// ---- more walls --------------------------------------------------------------------------------------------------------
/// A floor of two flush boxes, of one surface or of two.
std::vector<scene::Wall> seam(int dimensions, int left, int right)
{
    const double e = edge(dimensions), seam = 7 * dx - (dimensions == 3 ? 4 * dx : 0);
    return {{scene::Box{{-3 * dx, -3 * dx, -3 * dx}, {seam, e + 3 * dx, 0}}, scene::Surface(left), left == 2 ? 0.3 : 0},
            {scene::Box{{seam, -3 * dx, -3 * dx}, {e + 3 * dx, e + 3 * dx, 0}}, scene::Surface(right), right == 2 ? 0.2 : 0}};
}
/// A floor with a step across the period, and the points of its images: shapes and their images meet inside the cloud's reach.
Scene repeated(Scene s, int surface)
{
    const double e = edge(s.dimensions);
    s.space.low = Vector{0, -9, -9}, s.space.high = Vector{e, 9, 9}, s.space.periodic = {true, false, false};
    s.walls = {{scene::Box{{0, -dx, -3 * dx}, {e, e + dx, 0}}, scene::Surface(surface), surface == 2 ? 0.3 : 0},
               {scene::Box{{0, -dx, 0}, {2 * dx, e + dx, dx}}, scene::Surface(surface), surface == 2 ? 0.3 : 0}};
    return s;
}
Vector period_of(const Scene& s) { return {s.space.periodic[0] ? s.space.high->x - s.space.low->x : 0, 0, 0}; }
void repeat_walls(Cloud& c)
{
    const Vector period = period_of(c.scene);
    if (period.x == 0) return;
    for (auto& w : c.walls) {
        const std::size_t n = w.x.size();
        for (const double turn : {-1.0, 1.0})
            for (std::size_t k = 0; k < n; ++k) {
                w.x.push_back(w.x[k] + turn * period.x), w.y.push_back(w.y[k]), w.z.push_back(w.z[k]);
                w.id.push_back(w.id[k]);
            }
        w.sort(c.columns);
    }
}

// ---- the state -----------------------------------------------------------------------------------------------------------
/// Columns that a cloud has not, from the particles' ids.
struct State {
    double rate, slip, pressure;      // Pa/s, m, m/s^2
    double push;                      // N, of a load; 0: no loads
    std::vector<std::uint8_t> walled; // by id: slip and pressure are kept of particles at walls alone
    double shift = 0;                 // m/s
    bool flat = false;                // 2-D
    void operator()(Particles& p) const
    {
        if (push != 0) p.require(field::load, field::load_push);
        for (Index i = 0; i < p.size(); ++i) {
            std::mt19937_64 g(std::uint64_t(p[field::id][i]) + 17);
            const auto u = [&] { return std::uniform_real_distribution<double>(-1, 1)(g); };
            p[field::plastic_strain].set(i, 0.01 * std::fabs(u()));
            if (p.has(field::acceleration)) p[field::acceleration].set(i, Vector{u(), u(), u()});
            const Stress D = rate * Stress{u(), u(), u(), u(), u(), u()};
            if (p.has(field::stress_rate)) p[field::stress_rate].set(i, D);
            const double there = walled[std::size_t(p[field::id][i])];
            const Vector slipped = there * slip * Vector{u(), u(), u()};
            const double pressed = there * std::max(u(), 0.0);
            const double most = there * pressure * u(); // negative where the wall has pulled
            if (p.has(field::wall_slip)) {
                p[field::wall_slip].set(i, slipped), p[field::wall_pressure].set(i, pressed);
                p[field::wall_friction].set(i, most);
            }
            if (p.has(field::opened_volume)) p[field::opened_volume].set(i, i % 4 ? 0 : 1e-5 * std::fabs(u()));
            if (p.has(field::shift)) {
                std::mt19937_64 others(std::uint64_t(p[field::id][i]) + 71);
                const auto w = [&] { return std::uniform_real_distribution<double>(-1, 1)(others); };
                p[field::shift].set(i, shift * Vector{w(), flat ? 0 : w(), w()});
                p[field::shift_acceleration].set(i, Vector{w(), flat ? 0 : w(), w()});
            }
            if (push == 0) continue;
            p[field::load].set(i, std::int32_t(p[field::id][i] % 3)), p[field::load_push].set(i, push * Vector{u(), u(), u()});
        }
    }
};

// ---- the book's side -----------------------------------------------------------------------------------------------------
struct Read {
    std::vector<book::Strain> strain;
    std::vector<book::Strained> strained;
    std::vector<book::Forced> forced;
    int contacts[4] = {}, rubs[3] = {};
};
struct Steps {
    double dt, next; // s
};
double sound_of(const Cloud& c) { return std::ranges::max(c.soils, {}, &Material::c_p).c_p; }
double fastest_of(const Cloud& c)
{
    double fastest = 0;
    for (Index i = 0; i < c.particles.size(); ++i) fastest = std::max(fastest, length(std::as_const(c.particles)[field::velocity][i]));
    return fastest;
}
/// A step in which the fastest particle goes a tenth of h, if P-waves go no further than two.
Steps steps(const Cloud& c)
{
    const double dt = c.scene.smoothing_length() * std::min(0.1 / fastest_of(c), 2 / sound_of(c));
    return {dt, 0.7 * dt};
}
/// As much as the stress of the cloud pushes one particle.
double push_of(const Cloud& c)
{
    double stress = 0;
    for (Index i = 0; i < c.particles.size(); ++i) stress = std::max(stress, std::fabs(trace(c.particles[field::stress][i])));
    return stress * c.scene.particle_volume() / c.scene.smoothing_length();
}
State state_of(const Cloud& c)
{
    const auto& p = c.particles;
    const double support2 = c.scene.support() * c.scene.support();
    // A model may hold more terms than its scene asks for: without diffusion there is no rate of it.
    State state{c.scene.effects.stress_diffusion || c.scene.accuracy.shifting > 0 ? 1e3 / steps(c).dt : 0,
                1e-5 * c.scene.space.spacing,
                0.1 * sound_of(c) * sound_of(c) / c.scene.smoothing_length(),
                c.scene.loads.empty() ? 0 : push_of(c),
                std::vector<std::uint8_t>(std::size_t(p.size()), 0),
                0.2 * fastest_of(c),
                c.scene.dimensions == 2};
    for (Index i = 0; i < p.size(); ++i)
        for (const auto& w : c.walls)
            for (std::size_t k = 0; k < w.x.size(); ++k) {
                const Vector r = p[field::position][i] - Vector{w.x[k], w.y[k], w.z[k]};
                if (dot(r, r) < support2) state.walled[std::size_t(p[field::id][i])] = 1;
            }
    return state;
}
/// `other`: the scene whose effects and walls count, if not the cloud's.
struct Planted {
    bool at_end_of_step = false;                          // geometry of strain
    std::function<void(book::GroundPoint&)> of_wall = {}; // another face
};
Read by_the_book(const Cloud& c, const Scene* other = nullptr, const Planted& planted = {})
{
    const Scene& s = other ? *other : c.scene;
    Particles p = c.particles;
    p.require(field::acceleration, field::stress_rate, field::wall_slip, field::wall_pressure, field::wall_friction, field::opened_volume,
              field::shift, field::shift_acceleration);
    state_of(c)(p);
    const bool coulomb = std::ranges::any_of(c.scene.walls, [](const scene::Wall& w) { return w.surface == scene::Surface::Coulomb; });
    std::vector<Vector> x, v;
    std::vector<double> density;
    std::vector<Stress> stress;
    std::vector<std::int32_t> soil;
    std::vector<book::Kept> kept;
    for (Index i = 0; i < p.size(); ++i) {
        x.push_back(p[field::position][i]), v.push_back(p[field::velocity][i]), density.push_back(p[field::density][i]);
        stress.push_back(p[field::stress][i]), soil.push_back(p[field::soil][i]);
        book::Kept k{{},
                     s.effects.stress_diffusion || s.accuracy.shifting > 0 ? p[field::stress_rate][i] : Stress{},
                     {},
                     0,
                     0,
                     p[field::plastic_strain][i],
                     p[field::opened_volume][i]};
        if (coulomb) k.slip = p[field::wall_slip][i], k.pressed = p[field::wall_pressure][i], k.friction = p[field::wall_friction][i];
        if (s.accuracy.shifting > 0) k.shift = p[field::shift][i], k.shift_acceleration = p[field::shift_acceleration][i];
        if (const int l = s.loads.empty() ? -1 : p[field::load][i] - 1; l >= 0) {
            const scene::Load& load = s.loads[std::size_t(l)];
            if (load.follow) k.pressure = unit_pressure(s) * load.factor * *load.pressure;
            else k.push = load.factor * p[field::load_push][i];
        }
        kept.push_back(k);
    }
    const auto poses = poses_of(s);
    std::vector<scene::Wall> walls = s.walls;
    for (std::size_t w = 0; w < walls.size(); ++w) walls[w].shape = book::shifted(walls[w].shape, poses[w].after.shift);
    const auto ground = book::ground(walls, period_of(s), s.dimensions, s.space.spacing);
    std::vector<book::GroundPoint> points;
    for (const auto& w : c.walls)
        for (std::size_t k = 0; k < w.x.size(); ++k) {
            const Vector at = Vector{w.x[k], w.y[k], w.z[k]} + poses[std::size_t(w.wall)].after.shift;
            points.push_back({at, book::exposed_faces(ground, s.walls, at, s.support()), w.wall});
            if (planted.of_wall) planted.of_wall(points.back());
        }
    book::Setting setting{s.interactions(), c.soils, s.walls, damping};
    for (const auto& p : poses) {
        setting.motion.push_back((1 / wall_dt) * (p.after.shift - p.before.shift));
        setting.next_motion.push_back((1 / wall_next) * (p.later.shift - p.after.shift));
    }
    const book::Soil ground_soil{x, v, density, stress, soil};
    const auto [dt, next] = steps(c);
    Read read;
    std::vector<book::Strain> at_start;
    std::vector<book::Matrix> K;
    std::vector<book::Affine> affine;
    for (std::size_t i = 0; i < x.size(); ++i) {
        at_start.push_back(book::strain_of(i, ground_soil, kept, points, setting, 0));
        if (s.accuracy.correction == scene::Correction::Adjoint) K.push_back(at_start.back().K);
        const auto held =
            book::strained(book::particle(ground_soil, i, setting), c.soils[std::size_t(soil[i])], kept[i], at_start.back(), setting, 0);
        affine.push_back({at_start.back().L, held.weight});
    }
    for (std::size_t i = 0; i < x.size(); ++i) {
        const auto particle = book::particle(ground_soil, i, setting);
        read.strain.push_back(book::strain_of(i, ground_soil, kept, points, setting, planted.at_end_of_step ? 0 : dt));
        read.strained.push_back(book::strained(particle, c.soils[std::size_t(soil[i])], kept[i], read.strain.back(), setting, dt));
        book::Kept forced = kept[i];
        forced.acceleration = at_start[i].viscous, forced.friction = at_start[i].friction;
        read.forced.push_back(book::force_on(i, ground_soil, forced, K, affine, points, setting, dt, next));
        ++read.contacts[int(read.forced.back().contact)], ++read.rubs[int(read.forced.back().rubs)];
    }
    return read;
}

// ---- the two compared ------------------------------------------------------------------------------------------------------
double norm(const Mat3<double>& m) { return std::sqrt(dot(m.x, m.x) + dot(m.y, m.y) + dot(m.z, m.z)); }
double norm(const Stress& s) { return std::sqrt(contract(s, s)); }

/// Largest differences, each over what its sums may lose to rounding: the largest value, or what the largest stress or speed makes of
/// one neighbour.
struct Difference {
    double L = 0, stress = 0, density = 0, plastic = 0, viscous = 0, shift = 0;            // strain
    double acceleration = 0, velocity = 0, rate = 0, slip = 0, pressure = 0, friction = 0; // force
    double strain_energy[3] = {}, moved[4] = {}, before[6] = {}, later[6] = {};            // energies; moved: by viscosity at moving walls
    std::int64_t pairs = 0;
    double largest() const
    {
        double most =
            std::max({L, stress, density, plastic, viscous, shift, acceleration, velocity, pressure, friction}); // but for rate and slip
        for (const auto e : strain_energy) most = std::max(most, e);
        for (const auto e : moved) most = std::max(most, e);
        for (int k = 0; k < 6; ++k) most = std::max({most, before[k], later[k]});
        return most;
    }
};
std::ostream& operator<<(std::ostream& to, const Difference& d)
{
    to << "L " << d.L << " stress " << d.stress << " density " << d.density << " plastic strain " << d.plastic << " viscous " << d.viscous
       << " shift " << d.shift << " a " << d.acceleration << " v " << d.velocity << " stress rate " << d.rate << " slip " << d.slip
       << " pressure " << d.pressure << " friction " << d.friction << " pairs " << d.pairs << " energies of strain";
    for (const auto e : d.strain_energy) to << " " << e;
    to << " of moving walls";
    for (const auto e : d.moved) to << " " << e;
    to << " of force";
    for (int k = 0; k < 6; ++k) to << " " << d.before[k] << " " << d.later[k];
    return to;
}
struct Passed {
    StrainStageResult strain;
    ForceStageResult force;
    double unit;
};
Passed passed(const Cloud& c, Arithmetic arithmetic, const Read& read)
{
    const auto [dt, next] = steps(c);
    double most = 0; // J, so that energies are counted as finely as their sums allow
    for (std::size_t i = 0; i < read.strained.size(); ++i) {
        const auto& s = read.strained[i];
        const auto &b = read.forced[i].before, &a = read.forced[i].coming;
        for (const double e : {s.plastic, s.stabilising, s.wall, b.viscous, b.stabilising, b.wall, b.damping, a.viscous, a.wall, a.damping,
                               b.loads, a.loads})
            most = std::max(most, std::fabs(e));
    }
    const double unit = std::max(most, 1e-30) * 0x1p-44;
    const State state = state_of(c);
    return {run_strain(c, arithmetic, dt, unit, state), run_force(c, arithmetic, damping, dt, next, unit, state), unit};
}
Difference difference(const Cloud& c, const Passed& pass, const Read& read)
{
    const auto& p = c.particles;
    const auto &s = pass.strain.after, &f = pass.force.after;
    const auto [dt, next] = steps(c);
    const double h = c.scene.smoothing_length(), volume = c.scene.particle_volume();
    double stress = 0, speed = 0, density = 0, a = 0, L = 0, rate = 0, stiff = 0, shift = 1e-300;
    for (const auto& m : c.soils) stiff = std::max(stiff, m.bulk + m.shear);
    for (Index i = 0; i < p.size(); ++i) {
        stress = std::max(stress, norm(p[field::stress][i])), speed = std::max(speed, length(p[field::velocity][i]));
        density = std::max(density, p[field::density][i]);
        a = std::max(a, length(read.forced[i].acceleration)), L = std::max(L, norm(read.strain[i].L));
        rate = std::max(rate, norm(read.forced[i].stress_rate));
        shift = std::max(shift, length(read.strained[i].shift));
    }
    for (const auto& p : poses_of(c.scene)) speed = std::max(speed, length(p.after.shift - p.before.shift) / wall_dt);
    const double of_a = std::max(a, stress / (density * h)), of_L = std::max(L, speed / h), of_stress = std::max(stress, dt * stiff * of_L);
    const double of_energy =
        volume * std::max(of_stress, density * of_a * h) * std::max({of_L * dt, of_stress / stiff, of_a * dt * dt / h});
    Difference d;
    const auto note = [](double& worst, double is, double of) { worst = is / of <= worst ? worst : is / of; }; // NaN is the worst
    for (Index i = 0; i < p.size(); ++i) {
        const auto& strain = read.strain[i];
        const auto& strained = read.strained[i];
        const auto& forced = read.forced[i];
        note(d.L, norm(pass.strain.L[i] + -1.0 * strain.L), of_L);
        note(d.stress, norm(s[field::stress][i] - strained.stress), of_stress);
        note(d.density, std::fabs(s[field::density][i] - strained.density), density);
        note(d.plastic, std::fabs(s[field::plastic_strain][i] - strained.plastic_strain), std::max(0.01, of_L * dt));
        note(d.viscous, length(s[field::acceleration][i] - strain.viscous), of_a);
        if (s.has(field::shift)) {
            note(d.shift, length(s[field::shift][i] - strained.shift), std::max(shift, 8 * 0.2 * c.scene.accuracy.shifting * h * of_L));
            note(d.shift, length(s[field::shift_acceleration][i] - strained.shift_acceleration), of_L * 0.2 * fastest_of(c));
        }
        note(d.acceleration, length(f[field::acceleration][i] - forced.acceleration), of_a);
        note(d.velocity, length(f[field::velocity][i] - forced.velocity), speed + dt * of_a);
        if (f.has(field::stress_rate)) note(d.rate, norm(f[field::stress_rate][i] - forced.stress_rate), std::max(rate, 1e-300));
        if (!f.has(field::wall_slip)) continue;
        note(d.slip, length(f[field::wall_slip][i] - forced.slip), speed * dt);
        note(d.pressure, std::fabs(f[field::wall_pressure][i] - forced.pressed), of_a);
        note(d.friction, std::fabs(f[field::wall_friction][i] - forced.friction), of_a);
        note(d.friction, std::fabs(s[field::wall_friction][i] - strain.friction), of_a);
    }
    for (const auto& g : pass.strain.worked) {
        double plastic = 0, stabilising = 0, wall = 0;
        for (Index i = g.first; i < g.first + g.count; ++i)
            plastic += read.strained[i].plastic, stabilising += read.strained[i].stabilising, wall += read.strained[i].wall;
        note(d.strain_energy[0], std::fabs(g.result.energy.plastic - plastic), g.count * of_energy);
        note(d.strain_energy[1], std::fabs(g.result.energy.stabilising - stabilising), g.count * of_energy);
        note(d.strain_energy[2], std::fabs(g.result.energy.wall - wall), g.count * of_energy);
        double given = 0, coming = 0; // by moving walls through viscosity, a step of the same length after this one
        for (Index i = g.first; i < g.first + g.count; ++i) {
            const double mass = c.soils[std::size_t(p[field::soil][i])].density * volume;
            given += 0.5 * dt * mass * read.strain[i].power, coming += 0.5 * dt * mass * read.strain[i].next_power;
        }
        note(d.moved[0], std::fabs(g.result.energy.viscous - given), g.count * of_energy);
        note(d.moved[1], std::fabs(g.result.energy.moved_wall + given), g.count * of_energy);
        note(d.moved[2], std::fabs(g.result.later.viscous - coming), g.count * of_energy);
        note(d.moved[3], std::fabs(g.result.later.moved_wall + coming), g.count * of_energy);
    }
    for (const auto& g : pass.force.worked) {
        double before[6] = {}, later[6] = {};
        std::int64_t pairs = 0;
        for (Index i = g.first; i < g.first + g.count; ++i) {
            const auto add = [](double* to, const book::Taken& t) {
                to[0] += t.viscous, to[1] += t.stabilising, to[2] += t.wall, to[3] += t.damping, to[4] += t.moved_wall;
                to[5] += t.loads;
            };
            add(before, read.forced[i].before), add(later, read.forced[i].coming);
            pairs += read.forced[i].pairs;
        }
        const auto compare = [&](double* worst, const EnergySums& e, const double* sums) {
            const double is[6] = {e.viscous, e.stabilising, e.wall, e.damping, e.moved_wall, e.loads};
            for (int k = 0; k < 6; ++k) note(worst[k], std::fabs(is[k] - sums[k]), g.count * of_energy);
        };
        compare(d.before, g.result.energy, before), compare(d.later, g.result.later, later);
        d.pairs = std::max(d.pairs, std::abs(g.result.pairs - pairs));
    }
    return d;
}

// As in by_the_book_test.cpp. Stress diffusion of two on one point: the pass takes them to be 1e-6 h apart. Elastic slip: across the
// push of a wall that is about to let go, whose direction a small difference turns.
constexpr double sharp = 5e-12, sharp_diffusion = 5e-11, rough = 3e-5, rough_slip = 5e-4;
void expect_by_the_book(const Cloud& c, const Read& read, const std::string& what)
{
    for (const auto precision : {scene::Precision::Double, scene::Precision::Mixed})
        for (const auto arithmetic : {Arithmetic::Scalar, Arithmetic::Simd}) {
            Cloud d = c;
            d.scene.accuracy.precision = precision;
            const Passed pass = passed(d, arithmetic, read);
            const auto off = difference(c, pass, read);
            const bool exact = precision == scene::Precision::Double;
            EXPECT_LT(off.largest(), exact ? sharp : rough)
                << pass.strain.model << ", " << c.scene.dimensions << "-D, " << what << ": " << off;
            EXPECT_LT(off.rate, exact ? sharp_diffusion : rough) << pass.strain.model << ", " << c.scene.dimensions << "-D, " << what;
            EXPECT_LT(off.slip, exact ? sharp_diffusion : rough_slip) << pass.strain.model << ", " << c.scene.dimensions << "-D, " << what;
            EXPECT_EQ(off.pairs, 0) << pass.strain.model << ", " << c.scene.dimensions << "-D, " << what;
        }
}
Cloud walled_cloud(Arrangement kind, const Scene& s)
{
    Cloud c = cloud(kind, s);
    repeat_walls(c);
    return c;
}

} // namespace

TEST(StaggeredByTheBook, EveryModelFarFromWalls)
{
    for (const Scene& s : scenes(staggered))
        for (int kind = Lattice; kind <= Soils; ++kind) {
            if (kind == Creep) continue;
            const Cloud c = cloud(Arrangement(kind), s);
            expect_by_the_book(c, by_the_book(c), arrangements[kind]);
        }
}

TEST(StaggeredByTheBook, EveryModelBesideWallsOfEveryShapeAndSurface)
{
    int contacts[4] = {}, rubs[3] = {}, arrangement = 0;
    const auto hold = [&](const Scene& s, const std::string& what) {
        auto arranged = Arrangement(arrangement++ % 6); // another one for each wall and model
        // on a lattice particles lie in the planes of a step's edge, in front of which they may be or not by their last digits
        if (arranged == Lattice && s.space.periodic[0]) arranged = Jitter;
        const Cloud c = walled_cloud(arranged, s);
        const Read read = by_the_book(c);
        const auto clear = std::ranges::count_if(read.strain, [](const book::Strain& i) { return !i.beside_wall; });
        EXPECT_GT(clear, 0) << what;
        EXPECT_LT(clear, c.particles.size() - 10) << what;
        expect_by_the_book(c, read, what + ", " + arrangements[arranged]);
        for (int k = 0; k < 4; ++k) contacts[k] += read.contacts[k];
        for (int k = 0; k < 3; ++k) rubs[k] += read.rubs[k];
    };
    for (const Scene& bare : scenes(staggered)) {
        Scene s = bare;
        for (int surface = 0; surface < 3; ++surface) {
            for (int kind = 0; kind < 4; ++kind) {
                if (bare.dimensions == 2 && kind == 1) continue; // no cylinder in 2-D
                s.walls = {wall(kind, surface, s.dimensions)};
                hold(s, std::string(surfaces[surface]) + " " + shapes[kind]);
            }
            s.walls = seam(s.dimensions, surface, surface);
            hold(s, std::string(surfaces[surface]) + " seam");
            hold(repeated(bare, surface), std::string(surfaces[surface]) + " image across the period");
        }
        s.walls = seam(s.dimensions, 0, 1);
        hold(s, "seam of rough and smooth");
        s.walls = seam(s.dimensions, 2, 1);
        hold(s, "seam of Coulomb and smooth");
        s.walls = corner(s.dimensions);
        hold(s, "corner");
    }
    // every branch of Coulomb's law has been taken
    using book::Forced;
    for (const auto contact : {Forced::Contact::Presses, Forced::Contact::Approached, Forced::Contact::LetGo})
        EXPECT_GT(contacts[int(contact)], 50) << int(contact);
    for (const auto rub : {Forced::Rubs::Not, Forced::Rubs::Sticks, Forced::Rubs::Slides}) EXPECT_GT(rubs[int(rub)], 50) << int(rub);
}

TEST(StaggeredByTheBook, RealGroundHoldsSunkSoilOut)
{
    const double e = edge(3), cell = 1.3 * dx;
    scene::Grid heights{-8 * dx, -8 * dx, cell, 20, 20, {}};
    for (int row = 0; row < heights.rows; ++row)
        for (int column = 0; column < heights.columns; ++column)
            heights.values.push_back(1.2 * dx * std::sin(heights.x_of(column) / (3 * dx)) + 0.4 * heights.y_of(row) - 0.1 * e);
    const scene::Ground ground{std::make_shared<scene::HeightField>(heights), 5 * dx};
    scene::Grid frictions = heights; // rad
    frictions.for_each([&](int i, int j, std::size_t k) { frictions.values[k] = i > 14 ? std::nan("") : 0.3 + 0.02 * i + 0.01 * j; });
    int sunk = 0;
    for (const Scene& bare : scenes(staggered)) {
        if (bare.dimensions == 2) continue;
        for (int surface = 0; surface < 3; ++surface)
            for (const auto arranged : {Disorder, Soils}) {
                Scene s = bare;
                s.walls = {{ground, scene::Surface(surface), surface == 2 ? 0.4 : 0.0}};
                if (surface == 2 && arranged == Soils) { // of which friction and drag are not the same everywhere
                    s.walls[0].drag = 30;
                    std::get<scene::Ground>(s.walls[0].shape).friction = std::make_shared<scene::Grid>(frictions);
                }
                const Cloud c = cloud(arranged, s);
                for (Index i = 0; i < c.particles.size(); ++i)
                    sunk += scene::signed_distance(ground, std::as_const(c.particles)[field::position][i]) < 0;
                const Read read = by_the_book(c);
                expect_by_the_book(c, read, std::string(surfaces[surface]) + " ground, " + arrangements[arranged]);
                if (surface == 2 && arranged == Soils) {
                    Scene dragged = s, even = s;
                    dragged.walls[0].drag *= 1.1;
                    std::get<scene::Ground>(even.walls[0].shape).friction.reset();
                    for (const Scene& mistaken : {dragged, even})
                        EXPECT_GT(difference(c, passed(c, Arithmetic::Simd, read), by_the_book(c, &mistaken)).acceleration, 10 * rough);
                }
                if (surface == 0 || arranged == Soils) continue;
                // the control: how deep soil has sunk below the face
                const auto deeper = [](book::GroundPoint& w) {
                    for (auto& f : w.faces) f.depth *= 1.01;
                };
                const auto off = difference(c, passed(c, Arithmetic::Simd, read), by_the_book(c, nullptr, {.of_wall = deeper}));
                EXPECT_GT(off.acceleration, 10 * rough) << surfaces[surface];
            }
    }
    EXPECT_GT(sunk, 500);
}

TEST(StaggeredByTheBook, WallsThatMove)
{
    const auto moved = [](Scene s, const std::vector<double>& factors) {
        for (std::size_t w = 0; w < factors.size(); ++w) {
            s.walls[w].name = "wall " + std::to_string(w);
            const double f = factors[w];
            const Vector v = f * Vector{0.3, s.dimensions == 3 ? -0.2 : 0, 0.25};
            scene::Event e;
            e.from = 1.0, e.to = 1.51;
            e.move = scene::WallMove{s.walls[w].name, v, {}};
            s.events.push_back(e);
        }
        return s;
    };
    int arrangement = 0;
    for (const Scene& bare : scenes(staggered))
        for (int surface = 0; surface < 3; ++surface) {
            Scene s = bare;
            const auto hold = [&](const Scene& of, const std::string& what) {
                const auto arranged = Arrangement(1 + arrangement++ % 5);
                const Cloud c = walled_cloud(arranged, of);
                const Read read = by_the_book(c);
                const auto given = [](const book::Forced& i) { return i.before.moved_wall != 0 && i.coming.moved_wall != 0; };
                EXPECT_GT(std::ranges::count_if(read.forced, given), 5) << what;
                expect_by_the_book(c, read, what + ", " + arrangements[arranged]);
            };
            s.walls = {wall(arrangement % 4 == 1 && s.dimensions == 2 ? 3 : arrangement % 4, surface, s.dimensions)};
            hold(moved(s, {1}), std::string(surfaces[surface]) + " wall");
            s.walls = seam(s.dimensions, surface, surface);
            Scene one = moved(s, {1, 1});
            hold(one, std::string(surfaces[surface]) + " seam");
            s.walls = corner(s.dimensions);
            s.walls[0].surface = scene::Surface(surface);
            hold(moved(s, {0.5, -1}), std::string(surfaces[surface]) + " corner whose walls part");
        }
}

TEST(StaggeredByTheBook, Loads)
{
    // the first follows its faces, the second does not; every third particle has none
    const auto loaded = [](Scene s) {
        s.loads = {{.pressure = 2e3, .follow = true, .factor = 1.5}, {.pressure = 1.0, .factor = 0.7}};
        return s;
    };
    int arrangement = 0;
    for (const Scene& bare : scenes(staggered)) {
        const auto hold = [&](const Scene& s, const std::string& what) {
            const auto arranged = Arrangement(1 + arrangement++ % 5);
            const Cloud c = walled_cloud(arranged, loaded(s));
            const Read read = by_the_book(c);
            const auto given = [](const book::Forced& i) { return i.before.loads != 0 && i.coming.loads != 0; };
            EXPECT_GT(std::ranges::count_if(read.forced, given), c.particles.size() / 2) << what;
            expect_by_the_book(c, read, what + ", " + arrangements[arranged]);
            Scene mistaken = c.scene;
            mistaken.loads[arrangement % 2].factor *= 1.01;
            const auto off = difference(c, passed(c, Arithmetic::Simd, read), by_the_book(c, &mistaken));
            EXPECT_GT(off.largest(), 10 * sharp) << what; // the control
        };
        hold(bare, "loads far from walls");
        for (int surface = 0; surface < 3; ++surface) {
            Scene s = bare;
            s.walls = {wall(3, surface, s.dimensions)};
            hold(s, std::string("loads at a wall, ") + surfaces[surface]);
            s.walls = corner(s.dimensions);
            s.walls[0].surface = scene::Surface(surface);
            hold(s, std::string("loads in a corner, ") + surfaces[surface]);
        }
    }
}

TEST(StaggeredByTheBook, PoreWaterAndNoGravity)
{
    for (const int dimensions : {2, 3}) {
        Scene s = everything(dimensions, staggered);
        expect_by_the_book(cloud(Jitter, s), by_the_book(cloud(Jitter, s)), "pore water");
        s.walls = corner(dimensions);
        expect_by_the_book(cloud(Soils, s), by_the_book(cloud(Soils, s)), "pore water, corner, two soils");
        s.effects.gravity.reset();
        expect_by_the_book(cloud(Disorder, s), by_the_book(cloud(Disorder, s)), "no gravity, corner");
    }
}

TEST(StaggeredByTheBook, AdjointCorrection)
{
    for (const Scene& bare : scenes(staggered)) {
        if (bare.accuracy.correction == scene::Correction::None) continue;
        Scene s = bare;
        s.accuracy.correction = scene::Correction::Adjoint;
        for (const auto arranged : {Jitter, Disorder, Hard, Soils}) {
            expect_by_the_book(cloud(arranged, s), by_the_book(cloud(arranged, s)), "adjoint correction");
            Scene walled = s;
            walled.walls = corner(s.dimensions);
            const Cloud c = cloud(arranged, walled);
            expect_by_the_book(c, by_the_book(c), "adjoint correction in a corner");
            Scene mistaken = walled;
            mistaken.accuracy.correction = scene::Correction::Gradient;
            const auto off = difference(c, passed(c, Arithmetic::Simd, by_the_book(c)), by_the_book(c, &mistaken));
            EXPECT_GT(off.acceleration, 10 * rough) << "the pair forces' correction is not noticed";
        }
    }
}

TEST(StaggeredByTheBook, HourglassControl)
{
    int holding = 0, yielding = 0;
    for (const Scene& bare : scenes(staggered)) {
        if (bare.accuracy.correction == scene::Correction::None) continue;
        for (const auto correction : {scene::Correction::None, scene::Correction::Gradient, scene::Correction::Adjoint}) {
            Scene s = bare;
            s.accuracy.hourglass = 0.2, s.accuracy.correction = correction;
            s.soils[0].cohesion = 2e3;
            for (const auto arranged : {Jitter, Disorder, Hard, Soils}) {
                expect_by_the_book(cloud(arranged, s), by_the_book(cloud(arranged, s)), "hourglass control");
                Scene walled = s;
                walled.walls = corner(s.dimensions);
                const Cloud c = cloud(arranged, walled);
                const Read read = by_the_book(c);
                expect_by_the_book(c, read, "hourglass control in a corner");
                for (const auto& i : read.strained) ++(i.weight > 0 ? holding : yielding);
                Scene mistaken = walled;
                mistaken.accuracy.hourglass *= 1.02;
                const auto off = difference(c, passed(c, Arithmetic::Simd, read), by_the_book(c, &mistaken));
                EXPECT_GT(off.acceleration, 10 * rough) << "its strength is not noticed";
            }
        }
    }
    EXPECT_GT(holding, 500);
    EXPECT_GT(yielding, 500);
}

TEST(StaggeredByTheBook, SoilWhoseConeChanges)
{
    for (const int dimensions : {2, 3}) {
        Scene s = everything(dimensions, staggered);
        s.walls = {wall(3, 0, dimensions)};
        auto& soil = s.soils[0];
        soil.cohesion = 300, soil.dilation_angle = 0.1, soil.dilation_decay = 0.02;
        soil.softening = scene::Softening{50, 0.3, 0.001};
        soil.rate_friction = scene::RateFriction{0.6, 0.3, 0.002, 2600};
        const Cloud c = cloud(Jitter, s);
        const Read read = by_the_book(c);
        EXPECT_GT(std::ranges::count_if(read.strained, [](const book::Strained& i) { return i.plastic > 0; }), 50);
        expect_by_the_book(c, read, "softening, dilation that dies out, rate friction");
    }
}

// ---- controls: what a comparison as sharp as this must notice ------------------------------------------------------------
TEST(StaggeredByTheBook, NoticesAPlantedFaultInTheWalls)
{
    for (const int dimensions : {2, 3})
        for (int surface = 0; surface < 3; ++surface) {
            Scene s = everything(dimensions, staggered);
            s.walls = {wall(3, surface, dimensions)};
            const Cloud c = cloud(Jitter, s);
            const Read read = by_the_book(c);
            const Passed pass = passed(c, Arithmetic::Simd, read);
            const std::string what = std::string(surfaces[surface]) + ", " + std::to_string(dimensions) + "-D";
            EXPECT_LT(difference(c, pass, read).largest(), sharp) << what; // the control of the controls
            const auto expect_noticed = [&](const Read& planted, const char* fault) {
                EXPECT_GT(difference(c, pass, planted).largest(), 10 * rough) << what << ": " << fault;
            };
            for (int other = 0; other < 3; ++other) {
                Scene mistaken = s;
                mistaken.walls = {wall(3, other, dimensions)};
                if (other != surface) expect_noticed(by_the_book(c, &mistaken), surfaces[other]);
            }
            expect_noticed(by_the_book(c, nullptr, {.at_end_of_step = true}), "positions at the end of the step");
            const auto covered = [](book::GroundPoint& w) {
                if (w.x.x > 3 * dx) w.faces.clear();
            };
            expect_noticed(by_the_book(c, nullptr, {.of_wall = covered}), "faces that are not seen");
            if (surface == 0) continue; // nothing of a rough face counts but that it is there
            const auto farthest = [](book::GroundPoint& w) { std::ranges::reverse(w.faces); };
            expect_noticed(by_the_book(c, nullptr, {.of_wall = farthest}), "the farthest face instead of the nearest");
            const auto own = [&](book::GroundPoint& w) { w.faces.resize(std::min<std::size_t>(w.faces.size(), 1)); };
            expect_noticed(by_the_book(c, nullptr, {.of_wall = own}), "one face a point");
            if (surface == 2) {
                Scene mistaken = s;
                mistaken.walls[0].friction_angle *= 1.01;
                expect_noticed(by_the_book(c, &mistaken), "friction angle");
            }
        }
}

TEST(StaggeredByTheBook, NoticesAPlantedFaultInEveryTerm)
{
    for (const int dimensions : {2, 3}) {
        const Scene s = everything(dimensions, staggered);
        const Cloud c = cloud(Hard, s);
        const Passed pass = passed(c, Arithmetic::Simd, by_the_book(c));
        const auto planted = [&](const char* fault, auto change) {
            Scene mistaken = s;
            change(mistaken);
            const auto off = difference(c, pass, by_the_book(c, &mistaken));
            EXPECT_GT(std::max(off.largest(), off.rate), 10 * rough) << fault << ", " << dimensions << "-D";
        };
        plant_faults(planted);
        planted("shifting", [](Scene& m) { m.accuracy.shifting *= 1.01; });
    }
}
