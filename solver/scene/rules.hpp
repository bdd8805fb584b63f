#pragma once
// The rules of a scene, by what they judge; check() asks them all. Each tells what it finds.
#include "solver/scene/fill.hpp"
#include "solver/scene/issue.hpp"
#include "solver/scene/scene.hpp"
#include <fmt/format.h>
#include <numbers>
#include <string>

namespace kuzure::scene {

/// Collects issues by key.
struct Rules {
    Issues issues;
    void error(std::string key, std::string text, std::string other = {})
    {
        issues.push_back({Severity::Error, std::move(key), std::move(text), std::move(other)});
    }
    void warning(std::string key, std::string text, std::string other = {})
    {
        issues.push_back({Severity::Warning, std::move(key), std::move(text), std::move(other)});
    }
    bool errors() const
    {
        return std::any_of(issues.begin(), issues.end(), [](const Issue& i) { return i.severity == Severity::Error; });
    }
};
template <class... Args> std::string text(fmt::format_string<Args...> pattern, Args&&... args)
{
    return fmt::format(pattern, std::forward<Args>(args)...);
}
inline double degrees(double angle) { return angle * 180 / std::numbers::pi; }

/// Extents, periods, the kernel's width.
void check_space(const Scene&, Rules&);
/// Bodies and walls: their shapes, and what each of them says of itself.
void check_bodies(const Scene&, Rules&);
/// Bodies within the space, walls within its periods.
void check_inside(const Scene&, Rules&);
/// Soil that stands where its floor ends and no wall holds it: what runs over the edge falls without end.
void check_edges(const Scene&, Rules&);
/// Strength and its laws.
void check_soils(const Scene&, Rules&);
void check_effects(const Scene&, Rules&);
/// Numbers that are allowed but hardly ever meant: nearly always a unit, a factor of 1e3 or radians.
void check_plausible(const Scene&, Rules&);

} // namespace kuzure::scene
