#include "solver/scene/effects_list.hpp"
#include "solver/scene/at_rest.hpp"
#include "solver/scene/events.hpp"
#include "solver/scene/loads.hpp"
#include "solver/scene/material.hpp"
#include "solver/scene/rules.hpp"
#include "solver/scene/step_limits.hpp"
#include <algorithm>

namespace kuzure::scene {
namespace {

const char* name_of(Cone cone)
{
    static constexpr const char* names[] = {"compression", "extension", "plane strain", "plane strain, no dilation", "shear"};
    return names[int(cone)];
}

/// Friction angle (rad) up to which a cone without cohesion bears no tensile principal stress.
double widest_angle_without_tension(Cone cone)
{
    const double limit = Material::widest_cone_without_tension();
    double low = 0, high = std::numbers::pi / 2;
    if (Material::slope(cone, high * (1 - 1e-12)) <= limit) return high;
    while (high - low > 1e-12) {
        const double middle = 0.5 * (low + high);
        (Material::slope(cone, middle) <= limit ? low : high) = middle;
    }
    return low;
}

} // namespace

std::string tension_in(const Soil& soil)
{
    const Material m = Material::from(soil);
    if (soil.cohesion > 0) return fmt::format("soil {} has cohesion: c = {:.6g} Pa", soil.name, soil.cohesion);
    // The common limit of all cones, with room for the rounding of the angle.
    if (m.alpha > Material::widest_cone_without_tension() * (1 + 1e-12))
        return fmt::format("soil {} has phi = {:.4g} deg > {:.1f} deg, where the {} cone reaches tensile principal stress", soil.name,
                           degrees(soil.friction_angle), degrees(widest_angle_without_tension(soil.cone)), name_of(soil.cone));
    return {};
}
std::string why_no_tension(const Scene& scene)
{
    double least = std::numbers::pi / 2;
    bool cohesion = false;
    for (const auto& soil : scene.soils) {
        least = std::min(least, widest_angle_without_tension(soil.cone));
        cohesion = cohesion || soil.cohesion > 0;
    }
    const std::string strength = cohesion ? "no tension beyond the cut-off" : "c = 0";
    if (least > 1.57) return strength + ": no tensile principal stress can exist inside the cone at any phi";
    return fmt::format("{} and phi < {:.1f} deg: no tensile principal stress can exist", strength, degrees(least));
}

std::string no_static_part(const Scene& scene)
{
    const auto& g = scene.effects.gravity;
    if (g && (g->x != 0 || g->y != 0)) return "gravity is not vertical, so the ground is not level";
    for (const auto& e : scene.events) {
        if (e.gravity || !e.shaking.file.empty()) return "gravity changes while the run goes on";
        if (!e.add.empty() || !e.remove.empty()) return "walls or bodies come or go, so the ground may not stay level";
    }
    if (scene.soils.size() > 1) return "there are several soils, between which stress jumps";
    for (const auto& body : scene.bodies)
        if (!std::holds_alternative<Box>(body.shape) && !std::holds_alternative<Cylinder>(body.shape))
            return "a body is no box or cylinder, so the ground may not be level";
    if (scene.effects.pore_pressure) return "effective stress under water does not grow with the soil's own weight";
    return {};
}

namespace {

const std::string unwritten = "not in the scene";

/// The notes of a scene, one after the other; what is "auto" is decided as its line is written.
class List {
public:
    explicit List(Scene& scene) : scene_(scene), effects_(scene.effects) { scene_.notes.clear(); }
    void write()
    {
        body_force(), viscosity(), artificial_stress(), stress_diffusion(), pore_pressure(), accuracy(), damping();
        soils(), events(), walls(), space();
    }

private:
    void note(const char* name, bool on, std::string why) { scene_.notes.push_back({name, std::move(why), on}); }

    void body_force()
    {
        if (const auto& g = effects_.gravity) note("gravity", true, text("[{:.6g}, {:.6g}, {:.6g}] m/s^2", g->x, g->y, g->z));
        else note("gravity", false, unwritten);
    }

    void viscosity()
    {
        if (const auto& v = effects_.viscosity)
            note("viscosity", true,
                 text("alpha = {:.6g}, beta = {:.6g} against c_p: damps shocks and zero-energy modes", v->alpha, v->beta));
        else note("viscosity", false, unwritten);
    }

    /// Why some soil can bear tension, at the start or after an event; empty if none can.
    std::string tension() const
    {
        for (const auto& soil : scene_.soils)
            if (auto why = tension_in(soil); !why.empty()) return why;
        for (std::size_t k = 1; k <= scene_.events.size(); ++k)
            for (const auto& soil : stage_of(scene_, int(k), std::numeric_limits<double>::infinity()).soils)
                if (const auto why = tension_in(soil); !why.empty()) return "after an event " + why;
        return {};
    }

    void artificial_stress()
    {
        const std::string tension = this->tension();
        const bool automatic = effects_.artificial_stress_decision == Decision::Auto;
        if (automatic) {
            effects_.artificial_stress.reset();
            if (!tension.empty()) effects_.artificial_stress = ArtificialStress{};
        }
        if (const auto& a = effects_.artificial_stress)
            note("artificial_stress", true,
                 text("epsilon = {:.6g}, exponent = {:.6g}: {}", a->epsilon, a->exponent,
                      automatic ? tension + ", so tensile instability is possible" : "as written in the scene"));
        else note("artificial_stress", false, automatic ? why_no_tension(scene_) : unwritten);
    }

    void stress_diffusion()
    {
        const bool automatic = effects_.stress_diffusion_decision == Decision::Auto;
        const std::string reason = no_static_part(scene_);
        if (automatic) {
            effects_.stress_diffusion.reset();
            if (reason.empty()) effects_.stress_diffusion = StressDiffusion{};
        }
        if (const auto& d = effects_.stress_diffusion)
            note("stress_diffusion", true,
                 text("zeta = {:.6g}: {}", d->zeta,
                      automatic ? "one soil on level ground, noise of the spacing's length can be told from stress"
                                : "as written in the scene"));
        else note("stress_diffusion", false, automatic ? reason : unwritten);
    }

    void pore_pressure()
    {
        if (const auto& w = effects_.pore_pressure)
            note("pore_pressure", true,
                 text("still water of {:.6g} kg/m^3 below a table of {} corners; stresses are effective", w->density, w->table.size()));
        else note("pore_pressure", false, unwritten);
    }

    void accuracy()
    {
        const bool corrected = scene_.accuracy.correction != Correction::None, adjoint = scene_.accuracy.correction == Correction::Adjoint;
        note("gradient_correction", corrected,
             adjoint     ? "velocity gradients exact for linear fields, pair forces adjoint to them"
             : corrected ? "velocity gradients exact for linear fields; stress power no longer that of the pair forces"
                         : "accuracy.correction = \"none\"");
        const double shifting = scene_.accuracy.shifting;
        note("shifting", shifting > 0,
             shifting > 0
                 ? text("constant {:.3g}: soil that shears plastically keeps an even spacing, stress and velocity are carried along",
                        shifting)
                 : "accuracy.shifting = 0");
        const double hourglass = scene_.accuracy.hourglass;
        note("hourglass", hourglass > 0,
             hourglass > 0 ? text("strength {:.3g}: in soil that does not yield neighbours move as the velocity gradient says", hourglass)
                           : "accuracy.hourglass = 0");
        const double slow = scene_.accuracy.sleep_below;
        note("sleep", slow > 0,
             slow > 0 ? text("soil slower than {:.3g} m/s among soil as slow keeps its state, looked at every {} steps", slow,
                             sleep_interval(scene_))
                      : "accuracy.sleep_below = 0");
    }

    void damping()
    {
        if (const auto& d = effects_.damping) note("damping", true, text("{:.6g} of critical until t = {:.6g} s", d->ratio, d->until));
        else note("damping", false, unwritten);
    }

    template <class Wanted> std::string soils_with(Wanted wanted) const
    {
        std::string names;
        for (const auto& soil : scene_.soils)
            if (wanted(soil)) names += (names.empty() ? "" : ", ") + soil.name;
        return names;
    }
    void soils()
    {
        const auto dilating = soils_with([](const Soil& s) { return s.dilation_angle > 0; });
        note("dilation", !dilating.empty(), dilating.empty() ? "psi = 0: plastic flow keeps the volume" : "psi > 0 in " + dilating);
        const auto limited = soils_with([](const Soil& s) { return s.tension_cutoff.has_value(); });
        note("tension_cutoff", !limited.empty(),
             limited.empty() ? "mean tension is limited by the cone's apex only" : "written for " + limited);
        const auto decaying = soils_with([](const Soil& s) { return s.dilation_decay.has_value() && s.dilation_angle > 0; });
        note("dilation_decay", !decaying.empty(), decaying.empty() ? unwritten : "dilation dies out in " + decaying);
        const auto weak = soils_with([](const Soil& s) { return s.softening.has_value(); });
        note("softening", !weak.empty(),
             weak.empty() ? unwritten : text("{}: residual strength after a slip, bands taken {:.4g} m wide", weak, scene_.support()));
        const auto fast = soils_with([](const Soil& s) { return s.rate_friction.has_value(); });
        note("rate_friction", !fast.empty(), fast.empty() ? unwritten : "mu(I) in " + fast);
    }

    void events()
    {
        for (const int k : order_of_events(scene_)) {
            const Event& e = scene_.events[std::size_t(k)];
            note("event", true, text("{}: {}", time_in_words(e), in_words(scene_, e)));
        }
        for (std::size_t l = 0; l < scene_.loads.size(); ++l) note("load", true, in_words(scene_, int(l)));
        const auto resting = std::count_if(scene_.bodies.begin(), scene_.bodies.end(), rests);
        note("stress_at_rest", resting > 0,
             resting ? text("{} of {} bodies start with K0 stress under their own weight", resting, scene_.bodies.size())
                     : "every body starts without stress: gravity acts suddenly");
    }

    void walls()
    {
        const auto such = [&](const char* name, Surface surface, const char* meaning) {
            const auto n = std::ranges::count_if(scene_.walls, [&](const Wall& w) { return w.surface == surface; });
            note(name, n > 0, n ? text("{} of {} walls: {}", n, scene_.walls.size(), meaning) : "no such wall in the scene");
        };
        such("rough_walls", Surface::Rough, "no slip");
        such("smooth_walls", Surface::Smooth, "free slip");
        such("coulomb_walls", Surface::Coulomb, "shear limited by friction");
    }

    void space()
    {
        std::string periodic;
        for (int axis = 0; axis < 3; ++axis)
            if (scene_.space.periodic[std::size_t(axis)]) periodic += (periodic.empty() ? "" : ", ") + std::string(1, "xyz"[axis]);
        note("periodic", !periodic.empty(), periodic.empty() ? unwritten : "along " + periodic);
        const bool mixed = scene_.accuracy.precision == Precision::Mixed;
        note("mixed_precision", mixed, mixed ? "pair sums in single, state in double precision" : "everything in double precision");
    }

    Scene& scene_;
    Effects& effects_;
};

} // namespace

void resolve(Scene& scene)
{
    if (auto& maps = scene.maps) {
        if (maps->cell == 0) maps->cell = 2 * scene.space.spacing;
        if (maps->wet == 0) maps->wet = scene.space.spacing;
    }
    resolve_presence(scene);
    List(scene).write();
}

} // namespace kuzure::scene
