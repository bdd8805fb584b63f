#include "solver/app/report/scene_facts.hpp"
#include "io/ground/crs.hpp"
#include "io/scene_file.hpp"
#include "io/summary.hpp"
#include "solver/scene/check.hpp"
#include "solver/scene/ground.hpp"
#include "solver/scene/height_field.hpp"
#include "solver/scene/material.hpp"
#include "solver/scene/numbers.hpp"
#include "solver/scene/shape.hpp"
#include <cmath>
#include <fmt/format.h>
#include <iterator>
#include <nlohmann/json.hpp>
#include <numbers>

namespace kuzure {

namespace {

constexpr double degrees = 180 / std::numbers::pi;

const char* mass_unit(const Scene& s) { return s.dimensions == 2 ? "kg/m" : "kg"; }

/// Mass (kg, in 2-D kg/m) of one body's particles.
double mass_of(const Scene& s, const scene::Filling& f, int body)
{
    const auto& soil = s.soils[std::size_t(s.bodies[std::size_t(body)].soil)];
    return double(f.body_count(body)) * s.particle_volume() * soil.density;
}

/// What each body holds against its shape's volume, and what friction each soil's cone means.
nlohmann::ordered_json bodies_json(const Scene& s, const scene::Filling& f)
{
    auto all = nlohmann::ordered_json::array();
    for (int b = 0; b < int(s.bodies.size()); ++b)
        all.push_back({{"particles", f.body_count(b)}, {"mass", mass_of(s, f, b)}, {"excess_of_mass", scene::excess_of_mass(s, f, b)}});
    return all;
}
nlohmann::ordered_json soils_json(const Scene& s, const scene::Filling& f)
{
    auto all = nlohmann::ordered_json::object();
    for (const auto& soil : s.soils) {
        const auto m = Material::from(soil);
        all[soil.name] = {{"alpha", m.alpha},
                          {"k", m.k},
                          {"rough_bed_angle", m.angle_on_a_rough_bed() * degrees},
                          {"stress_circle_angle", m.circle_is_limited() ? nlohmann::ordered_json(m.angle_of_the_stress_circle() * degrees)
                                                                        : nlohmann::ordered_json()}};
    }
    for (const auto& n : scene::soil_numbers(s, f)) {
        auto& soil = all[n.name];
        soil["unit_weight"] = n.unit_weight, soil["at_rest"] = n.K0, soil["stability"] = n.stability;
        soil["c_p"] = n.c_p, soil["c_s"] = n.c_s;
    }
    return all;
}
std::string bodies_and_soils_text(const Scene& s, const scene::Filling& f)
{
    std::string text;
    for (int b = 0; b < int(s.bodies.size()); ++b) {
        const double excess = scene::excess_of_mass(s, f, b);
        text +=
            fmt::format("  body.{:<7}{} particles, {:.4g} {}: {} its shape's volume\n", b, f.body_count(b), mass_of(s, f, b), mass_unit(s),
                        std::abs(excess) < 5e-7 ? "the mass of"
                                                : fmt::format("{:.2g} % {} than", 100 * std::abs(excess), excess > 0 ? "more" : "less"));
    }
    for (const auto& soil : s.soils) {
        const auto m = Material::from(soil);
        text += fmt::format(
            "  soil.{:<7}alpha {:.4g}, k {:.4g} Pa: in plane strain at psi = 0 a slope on a rough bed of {:.1f} deg (atan 3 alpha), "
            "{} by the stress circle (asin 3 alpha)\n",
            soil.name, m.alpha, m.k, m.angle_on_a_rough_bed() * degrees,
            m.circle_is_limited() ? fmt::format("{:.1f} deg", m.angle_of_the_stress_circle() * degrees) : "no limit");
    }
    return text;
}

/// As JSON has whole numbers.
std::int64_t whole(double bytes) { return std::int64_t(std::min(bytes, 9e18)); }

} // namespace

namespace {

const char* bed_of(const scene::Release& r)
{
    if (!r.surface.empty()) return "the slip surface";
    if (!r.after.empty()) return "the elevation model after";
    return r.on_top ? "the elevation model" : "the elevation model less the thickness";
}

nlohmann::ordered_json ground_json(const Scene& s, const scene::HeightField& field)
{
    const scene::Grid& g = field.grid();
    nlohmann::ordered_json j{{"crs", io::crs_name(s.map_frame.crs)},
                             {"origin", {s.map_frame.x, s.map_frame.y}},
                             {"columns", g.columns},
                             {"rows", g.rows},
                             {"cell", g.cell},
                             {"lowest", field.lowest()},
                             {"highest", field.highest()},
                             {"releases", nlohmann::ordered_json::array()}};
    for (std::size_t b = 0; b < s.bodies.size(); ++b)
        if (const auto* r = std::get_if<scene::Release>(&s.bodies[b].shape)) {
            const auto e = scene::extent(*r);
            const double mean = e.area > 0 ? e.volume / e.area : 0;
            j["releases"].push_back({{"body", b},
                                     {"volume", e.volume},
                                     {"area", e.area},
                                     {"mean_thickness", mean},
                                     {"greatest_thickness", e.thickest},
                                     {"layers", mean / s.space.spacing},
                                     {"bed", bed_of(*r)}});
        }
    return j;
}

std::string ground_text(const Scene& s, const scene::HeightField& field)
{
    const auto j = ground_json(s, field);
    auto text =
        fmt::format("  ground      {} x {} cells of {:g} m, {:.1f} to {:.1f} m high, the scene's origin at ({:.10g}, {:.10g}) in {}\n",
                    field.grid().columns, field.grid().rows, field.grid().cell, field.lowest(), field.highest(), s.map_frame.x,
                    s.map_frame.y, io::crs_name(s.map_frame.crs));
    for (const auto& r : j["releases"])
        text += fmt::format(
            "  release     body.{}: {:.4g} m^3 on {:.4g} m^2, {:.2f} m thick on average ({:.1f} layers), {:.2f} m at most; its bed is {}\n",
            r["body"].get<int>(), r["volume"].get<double>(), r["area"].get<double>(), r["mean_thickness"].get<double>(),
            r["layers"].get<double>(), r["greatest_thickness"].get<double>(), r["bed"].get<std::string>());
    return text;
}

} // namespace

nlohmann::ordered_json to_json(const SceneFacts& f)
{
    const Scene& s = f.scene;
    const scene::Filling& filling = f.filling;
    const Estimate& e = f.estimate;
    auto numbers = nlohmann::ordered_json::object();
    for (const auto& n : scene::dimensionless_numbers(s, filling)) numbers[n.name] = n.value;
    nlohmann::ordered_json j{{"scene_hash", io::scene_hash(s)},
                             {"soil_particles", e.soil},
                             {"wall_particles", e.walls},
                             {"dt", e.dt},
                             {"steps", e.steps},
                             {"memory_bytes", whole(f.memory)},
                             {"disk_bytes", whole(e.disk())},
                             {"predicted_seconds", f.time.seconds},
                             {"predicted_interval", {f.time.low, f.time.high}},
                             {"bodies", bodies_json(s, filling)},
                             {"soils", soils_json(s, filling)},
                             {"effects", io::effects_json(s.notes)},
                             {"numbers", numbers},
                             {"warnings", f.warnings}};
    if (const auto* field = scene::ground_of(s)) j["ground"] = ground_json(s, *field);
    return j;
}

std::string to_text(const SceneFacts& f)
{
    const Scene& s = f.scene;
    const scene::Filling& filling = f.filling;
    const Estimate& e = f.estimate;
    std::string text;
    const auto add = [&]<class... T>(fmt::format_string<T...> format, T&&... values) {
        fmt::format_to(std::back_inserter(text), format, std::forward<T>(values)...);
    };
    add("{}\n\n", s.title);
    add("  particles   {} soil, {} wall, {:g} m apart, {}-D\n", e.soil, e.walls, s.space.spacing, s.dimensions);
    add("  step        {:.3g} s{}, {}{} steps to {:g} s\n", e.dt, s.time.step ? " (fixed)" : " (follows the motion)",
        s.time.step ? "" : "about ", e.steps, s.time.end);
    if (const auto* field = scene::ground_of(s)) text += ground_text(s, *field);
    add("  pair model  {}\n", f.pair_model);
    add("  memory      {} in all, disk {}\n", bytes_text(f.memory), bytes_text(e.disk()));
    add("  time        about {} on {}\n\n", forecast_text(f.time), f.where);
    add("{}\n", bodies_and_soils_text(s, filling));
    for (const auto& n : s.notes) add("  {:<4}{}: {}\n", n.on ? "on" : "off", n.name, n.why);
    add("\n");
    for (const auto& n : scene::dimensionless_numbers(s, filling)) add("  {:<12}{:<9.3g} {}\n", n.name, n.value, n.about);
    add("\n");
    for (const auto& n : scene::soil_numbers(s, filling)) {
        add("  soil {:<10}", n.name);
        if (n.unit_weight > 0) add("unit weight {:.4g} kN/m3, c/(gamma H) {:.3g}, ", 1e-3 * n.unit_weight, n.stability);
        add("K0 {:.3g}, c_p {:.3g} m/s, c_s {:.3g} m/s\n", n.K0, n.c_p, n.c_s);
    }
    for (const auto& w : f.warnings) add("\n  warning: {}\n", w);
    add("\n{}", io::write_scene(s));
    return text;
}

} // namespace kuzure
