#include "solver/app/report/chart.hpp"
#include "solver/app/report/page.hpp"
#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <limits>

namespace kuzure::report {

namespace {

constexpr double width = 520, height = 300, left = 64, right = 24, top = 14, bottom = 44;
constexpr int colours = 7;
constexpr double infinite = std::numeric_limits<double>::infinity();

/// 1, 2 or 5 times a power of ten: about `count` steps over the range.
double tick_step(double range, int count)
{
    const double raw = range / count, power = std::pow(10.0, std::floor(std::log10(raw)));
    for (const double m : {1.0, 2.0, 5.0})
        if (m * power >= raw * (1 - 1e-9)) return m * power;
    return 10 * power;
}

struct Prefix {
    double factor;
    const char* letter;
};
Prefix prefix_of(double largest)
{
    if (largest >= 1e9) return {1e-9, "G"};
    if (largest >= 1e6) return {1e-6, "M"};
    if (largest >= 2e3) return {1e-3, "k"};
    return {1, ""};
}

std::string tick_text(double v, double step)
{
    if (std::fabs(v) < 1e-9 * step) v = 0;
    if (step < 1e-4 || step >= 1e6) return fmt::format("{:.3g}", v);
    return fmt::format("{:.{}f}", v, std::max(0, int(std::ceil(-std::log10(step) - 1e-9))));
}

std::string line(const char* kind, double x1, double y1, double x2, double y2)
{
    return fmt::format("<line class=\"{}\" x1=\"{:.1f}\" y1=\"{:.1f}\" x2=\"{:.1f}\" y2=\"{:.1f}\"/>", kind, x1, y1, x2, y2);
}
std::string label(double x, double y, const char* anchor, const std::string& text, const char* kind = "")
{
    return fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\" class=\"{}\">{}</text>", x, y, anchor, kind, escaped(text));
}
std::string head(const std::string& title, const std::string& x_axis)
{
    return fmt::format("<svg viewBox=\"0 0 {} {}\" role=\"img\" aria-label=\"{}\">", width, height, escaped(title)) +
           label(0.5 * (left + width - right), height - 8, "middle", x_axis);
}

} // namespace

std::string shown(double v, bool prefixed)
{
    if (!std::isfinite(v)) return "-";
    const Prefix p = prefixed ? prefix_of(std::fabs(v)) : Prefix{1, ""};
    return fmt::format("{:.4g}{}{}", v * p.factor, *p.letter ? " " : "", p.letter);
}

std::string chart(const std::string& title, const std::string& x_name, const std::string& x_unit, std::span<const double> x,
                  const std::string& y_unit, const std::vector<Curve>& curves, bool from_zero)
{
    const std::string caption = "<figcaption><b>" + escaped(title) + "</b></figcaption>";
    double lo = from_zero ? 0 : infinite, hi = from_zero ? 0 : -infinite;
    for (const auto& c : curves)
        for (const double v : c.y)
            if (std::isfinite(v)) lo = std::min(lo, v), hi = std::max(hi, v);
    if (x.size() < 2 || !(x.back() - x.front() > 1e-9 * std::max({std::fabs(x.front()), std::fabs(x.back()), 1e-200})) || lo > hi)
        return "<figure>" + caption + "<p class=\"soft small\">Fewer than two rows were written: no curve.</p></figure>";
    if (hi - lo < std::max(1e-200, 1e-12 * std::max(std::fabs(lo), std::fabs(hi))))
        lo -= 0.5 * std::max(1e-12, std::fabs(lo)), hi = lo + std::max(2e-12, 2 * std::fabs(hi));
    const double step = tick_step(hi - lo, 5), x0 = x.front(), x1 = x.back(), x_step = tick_step(x1 - x0, 6);
    lo = std::floor(lo / step + 1e-9) * step, hi = std::ceil(hi / step - 1e-9) * step;
    const Prefix p = y_unit == "1" ? Prefix{1, ""} : prefix_of(std::max(std::fabs(lo), std::fabs(hi)));
    const std::string unit = y_unit == "1" ? "" : p.letter + y_unit;
    const auto px = [&](double v) { return left + (width - left - right) * (v - x0) / (x1 - x0); };
    const auto py = [&](double v) { return top + (height - top - bottom) * (hi - v) / (hi - lo); };

    std::string s = "<figure>" + caption + head(title, x_name + " [" + x_unit + "]");
    for (double v = lo; v <= hi + 1e-6 * step && v + step > v; v += step)
        s += line(std::fabs(v) < 1e-9 * step ? "axis" : "grid", left, py(v), width - right, py(v)) +
             label(left - 7, py(v) + 4, "end", tick_text(v * p.factor, step * p.factor));
    for (double v = std::ceil(x0 / x_step - 1e-9) * x_step; v <= x1 + 1e-6 * x_step && v + x_step > v; v += x_step)
        s += line("grid", px(v), top, px(v), height - bottom) + label(px(v), height - bottom + 17, "middle", tick_text(v, x_step));
    if (!unit.empty())
        s += fmt::format("<text transform=\"translate(13 {:.1f}) rotate(-90)\" text-anchor=\"middle\">{}</text>",
                         0.5 * (top + height - bottom), escaped(unit));
    std::string legend;
    for (std::size_t k = 0; k < curves.size(); ++k) {
        const auto& c = curves[k];
        const std::size_t n = std::min(x.size(), c.y.size()), every = std::max<std::size_t>(1, n / 500);
        std::string points;
        bool pen_down = false;
        double last = std::nan("");
        for (std::size_t i = 0; i < n; ++i) {
            if (i % every != 0 && i + 1 != n) continue;
            if (!std::isfinite(c.y[i]) || !std::isfinite(x[i])) {
                pen_down = false;
                continue;
            }
            points += fmt::format("{}{:.1f} {:.1f}", pen_down ? "L" : "M", px(x[i]), py(c.y[i]));
            pen_down = true, last = c.y[i];
        }
        s += fmt::format("<path class=\"k{}\" fill=\"none\" stroke-width=\"2\" stroke-linejoin=\"round\" d=\"{}\"><title>{}</title></path>",
                         k % colours, points, escaped(c.label));
        legend += fmt::format("<li><span class=\"s{}\">&#9632;</span> {} {}{}{}</li>", k % colours, escaped(c.label),
                              shown(last * p.factor), unit.empty() ? "" : " ", escaped(unit));
    }
    return s + "</svg><ul class=\"legend\" title=\"last values\">" + legend + "</ul></figure>";
}

std::string roofline(const Roofs* roofs, const std::vector<Dot>& dots)
{
    double x0 = 0.1, x1 = 100, y1 = roofs ? roofs->gflops * 2 : 1, y0 = y1;
    for (const auto& d : dots) {
        while (d.intensity < x0 * 1.2) x0 /= 10;
        while (d.intensity > x1 / 1.2) x1 *= 10;
        y1 = std::max(y1, d.gflops * 2), y0 = std::min(y0, d.gflops / 2);
    }
    if (roofs) y0 = std::min(y0, roofs->gflops / 100);
    y0 = std::pow(10.0, std::floor(std::log10(y0))), y1 = std::pow(10.0, std::ceil(std::log10(y1)));
    const auto px = [&](double v) { return left + (width - left - right) * std::log(v / x0) / std::log(x1 / x0); };
    const auto py = [&](double v) { return top + (height - top - bottom) * std::log(y1 / v) / std::log(y1 / y0); };
    std::string s = "<figure><figcaption><b>Roofline: reached against possible</b></figcaption>" +
                    head("roofline", "operations per byte of memory traffic [flop/byte]");
    for (double v = y0; v <= y1 * 1.01; v *= 10)
        s += line("grid", left, py(v), width - right, py(v)) + label(left - 7, py(v) + 4, "end", fmt::format("{:g}", v));
    for (double v = x0; v <= x1 * 1.01; v *= 10)
        s += line("grid", px(v), top, px(v), height - bottom) + label(px(v), height - bottom + 17, "middle", fmt::format("{:g}", v));
    s += fmt::format("<text transform=\"translate(13 {:.1f}) rotate(-90)\" text-anchor=\"middle\">Gflop/s</text>",
                     0.5 * (top + height - bottom));
    if (roofs) {
        const double ridge = roofs->gflops / roofs->gbytes, from = std::max(x0, y0 / roofs->gbytes);
        s += fmt::format("<path class=\"roof\" d=\"M{:.1f} {:.1f}L{:.1f} {:.1f}L{:.1f} {:.1f}\"/>", px(from), py(from * roofs->gbytes),
                         px(ridge), py(roofs->gflops), px(x1), py(roofs->gflops));
        s += label(width - right - 4, py(roofs->gflops) - 7, "end", fmt::format("{}: {:.0f} Gflop/s", roofs->label, roofs->gflops),
                   "strong");
        const double at = std::sqrt(from * ridge);
        s += label(px(at) - 8, py(at * roofs->gbytes) - 6, "end", fmt::format("{:.0f} GB/s", roofs->gbytes), "strong");
    }
    std::string legend;
    for (std::size_t k = 0; k < dots.size(); ++k) {
        const auto& d = dots[k];
        const double roof = roofs ? std::min(roofs->gflops, d.intensity * roofs->gbytes) : 0;
        const std::string share = roofs ? fmt::format(", {:.2g} % of its roof", 100 * d.gflops / roof) : "";
        const std::string text = fmt::format("{}: {:.3g} Gflop/s at {:.2g} flop/byte{}", d.label, d.gflops, d.intensity, share);
        s += fmt::format("<circle class=\"d{}\" cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"6\"><title>{}</title></circle>", k % colours,
                         px(d.intensity), py(d.gflops), escaped(text));
        legend += fmt::format("<li><span class=\"s{}\">&#9679;</span> {}</li>", k % colours, escaped(text));
    }
    return s + "</svg><ul class=\"legend\">" + legend + "</ul></figure>";
}

} // namespace kuzure::report
