#include "solver/scene/column_bytes.hpp"
#include "solver/core/field.hpp"
#include <algorithm>

namespace kuzure::scene {

double column_bytes(const Scene& scene, const Filling& filling)
{
    const bool leap_frog = scene.accuracy.scheme == Scheme::LeapFrog;
    const bool coulomb = std::ranges::any_of(scene.walls, [](const Wall& w) { return w.surface == Surface::Coulomb; });
    const bool remembers = std::ranges::any_of(scene.soils, [](const Soil& s) { return s.opened_volume == OpenedVolume::Kept; });
    const auto carried = [&]<class F>(F) {
        const auto is = [](auto... f) { return (std::is_same_v<F, std::remove_const_t<decltype(f)>> || ...); };
        if (is(field::half_velocity, field::half_density, field::half_stress)) return leap_frog;
        if (is(field::acceleration)) return !leap_frog;
        const bool shifts = !leap_frog && scene.accuracy.shifting > 0;
        if (is(field::stress_rate)) return shifts || (!leap_frog && scene.effects.stress_diffusion.has_value());
        if (is(field::gradient_matrix, field::strain_matrix)) return scene.accuracy.correction == Correction::Adjoint;
        if (is(field::shift, field::shift_acceleration)) return shifts;
        if (is(field::wall_slip, field::wall_pressure, field::wall_friction)) return !leap_frog && coulomb;
        if (is(field::wall_force)) return !leap_frog && std::ranges::any_of(scene.walls, [](const Wall& w) { return !w.name.empty(); });
        if (is(field::load, field::load_push)) return !scene.loads.empty();
        if (is(field::unstored)) return std::ranges::any_of(scene.loads, [](const Load& l) { return l.plate; });
        if (is(field::opened_volume)) return remembers;
        if (is(field::activity)) return scene.accuracy.sleep_below > 0;
        return true;
    };
    double bytes = 0;
    std::apply([&](auto... f) { ((bytes += carried(f) ? double(sizeof(typename decltype(f)::Number)) * f.components : 0), ...); },
               AllFields{});
    return bytes * double(filling.soil_count());
}

} // namespace kuzure::scene
