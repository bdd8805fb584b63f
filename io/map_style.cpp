#include "io/map_style.hpp"
#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <span>

namespace kuzure::io {
namespace {

// Of ColorBrewer: from light yellow to dark red (YlOrRd); from blue by white to red (RdBu).
constexpr std::array<Rgb, 7> rising{
    {{255, 255, 178}, {254, 217, 118}, {254, 178, 76}, {253, 141, 60}, {240, 59, 32}, {189, 0, 38}, {110, 0, 30}}};
constexpr std::array<Rgb, 7> signed_colors{
    {{33, 102, 172}, {103, 169, 207}, {209, 229, 240}, {247, 247, 247}, {253, 219, 199}, {239, 138, 98}, {178, 24, 43}}};
constexpr int stops = 11;

} // namespace

Rgb map_color(double share, bool signs)
{
    const auto& colors = signs ? signed_colors : rising;
    const double at = std::clamp(share, 0.0, 1.0) * double(colors.size() - 1);
    const auto k = std::min(std::size_t(at), colors.size() - 2);
    const auto between = [&](std::uint8_t a, std::uint8_t b) { return std::uint8_t(std::lround(a + (at - double(k)) * (b - a))); };
    return {between(colors[k].r, colors[k + 1].r), between(colors[k].g, colors[k + 1].g), between(colors[k].b, colors[k + 1].b)};
}

std::string qml_style(const MapKind& kind, double low, double high)
{
    std::string items;
    for (int k = 0; k < stops; ++k) {
        const double share = double(k) / (stops - 1), value = low + share * (high - low);
        const Rgb c = map_color(share, has_signs(kind));
        items += fmt::format("          <item value=\"{:.9g}\" label=\"{:.3g} {}\" color=\"#{:02x}{:02x}{:02x}\" alpha=\"255\"/>\n", value,
                             value, kind.unit, c.r, c.g, c.b);
    }
    return fmt::format(R"(<!DOCTYPE qgis PUBLIC 'http://mrcc.com/qgis.dtd' 'SYSTEM'>
<qgis version="3.22" styleCategories="Symbology">
  <pipe>
    <rasterrenderer type="singlebandpseudocolor" band="1" opacity="0.85" alphaBand="-1" classificationMin="{0:.9g}" classificationMax="{1:.9g}" nodataColor="">
      <rasterTransparency/>
      <rastershader>
        <colorrampshader colorRampType="INTERPOLATED" classificationMode="2" clip="0" minimumValue="{0:.9g}" maximumValue="{1:.9g}">
{2}        </colorrampshader>
      </rastershader>
    </rasterrenderer>
  </pipe>
</qgis>
)",
                       low, high, items);
}

} // namespace kuzure::io
