// What a back-analysis seeks, and in which range: --input, [uncertain], or what friction can be.
#include "solver/app/hazard/back_analysis.hpp"
#include <algorithm>
#include <charconv>
#include <cmath>
#include <fmt/format.h>
#include <fmt/ranges.h>

namespace kuzure::hazard {
namespace {

constexpr int scan_of_one = 9, scan_of_two = 5;

std::optional<scene::Triangle>* named(scene::Uncertain& u, const std::string& name)
{
    return name == "bed_friction" ? &u.bed_friction : name == "friction" ? &u.friction : name == "thickness" ? &u.thickness : nullptr;
}

std::array<double, 2> range_of(const std::string& option, const std::string& text)
{
    std::array<double, 2> r{};
    const char *at = text.data(), *end = at + text.size();
    for (std::size_t k = 0; k < 2; ++k) {
        const auto [to, error] = std::from_chars(at, end, r[k]);
        const bool good = error == std::errc{} && std::isfinite(r[k]) && (k == 1 ? to == end : to < end && *to == ',');
        if (!good)
            throw BadInput(fmt::format("--input {}: expected NAME=LOW,HIGH, found \"{}\"; write, for example, --input bed_friction=10,35",
                                       option, text));
        at = to + 1;
    }
    if (!(r[0] < r[1]))
        throw BadInput(fmt::format("--input {}: expected LOW < HIGH; write, for example, --input bed_friction=10,35", option));
    const bool angle = option.starts_with("friction=") || option.starts_with("bed_friction=");
    if (angle && !(r[0] >= 0 && r[1] < 90))
        throw BadInput(fmt::format("--input {}: expected angles in deg, 0 <= LOW and HIGH < 90", option));
    if (option.starts_with("thickness=") && !(r[0] >= 0.1 && r[1] <= 10))
        throw BadInput(fmt::format("--input {}: expected factors on the thickness from 0.1 to 10", option));
    return r;
}

} // namespace

std::vector<Axis> axes_for(std::vector<std::string> asked, int values, scene::Uncertain& u)
{
    std::vector<Axis> axes;
    if (asked.empty()) asked.push_back("bed_friction");
    if (asked.size() > 2) throw BadInput(fmt::format("--input: expected one or two inputs, found {}", asked.size()));
    for (const auto& text : asked) {
        const auto equals = text.find('=');
        const std::string name = text.substr(0, equals);
        auto* of_name = named(u, name);
        const auto key = std::ranges::find(u.keys, name, &scene::UncertainKey::key);
        if (!of_name && key == u.keys.end()) {
            std::vector<std::string> known{"bed_friction", "friction", "thickness"};
            for (const auto& k : u.keys) known.push_back(k.key);
            throw BadInput(fmt::format("--input {}: expected one of {}, found none of this name. Remedy: any other number of the scene by "
                                       "[[uncertain.key]] key = \"{}\" (docs/hazard.md)",
                                       name, fmt::join(known, ", "), name));
        }
        if (std::ranges::any_of(axes, [&](const Axis& x) { return x.name == name; }))
            throw BadInput(fmt::format("--input {}: found twice; leave one out", name));
        Axis axis{.name = name, .unit = {}};
        scene::Triangle* range = of_name ? (*of_name ? &**of_name : nullptr) : &key->value;
        if (equals != text.npos) {
            const auto [low, high] = range_of(text, text.substr(equals + 1));
            if (!range) range = &of_name->emplace(scene::Triangle{low, 0.5 * (low + high), high});
            range->low = low, range->high = high, range->likely = std::clamp(range->likely, low, high);
        } else if (!range && name == "thickness") {
            range = &of_name->emplace(scene::Triangle{0.5, 1, 2});
        } else if (!range) {
            range = &of_name->emplace(scene::Triangle{5, 25, 45}); // friction of anything that slides on ground
        }
        if (!(range->low < range->high))
            throw BadInput(fmt::format("--input {}: expected a range, found {:g} to {:g}. Remedy: --input {}=LOW,HIGH", name, range->low,
                                       range->high, name));
        axis.low = range->low, axis.high = range->high;
        axes.push_back(axis);
    }
    for (const auto& i : inputs_of(u))
        for (auto& axis : axes)
            if (axis.name == i.name) axis.unit = i.unit;
    const int usual = axes.size() == 1 ? scan_of_one : scan_of_two;
    for (auto& axis : axes) axis.scan = values > 0 ? values : usual;
    choose_parts(axes);
    return axes;
}

} // namespace kuzure::hazard
