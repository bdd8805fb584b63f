#include "solver/app/report/values.hpp"
#include <cmath>
#include <fmt/format.h>

namespace kuzure::report {

std::string duration(double seconds)
{
    if (!(std::fabs(seconds) < 1e12)) return "-";
    if (seconds < 1) return fmt::format("{:.2f} s", seconds);
    if (seconds < 100) return fmt::format("{:.1f} s", seconds);
    const auto s = std::llround(seconds);
    if (s < 6000) return fmt::format("{} min {} s", s / 60, s % 60);
    if (s < 172800) return fmt::format("{} h {} min", s / 3600, s % 3600 / 60);
    return fmt::format("{} d {} h", s / 86400, s % 86400 / 3600);
}

std::string grouped(double n)
{
    if (!std::isfinite(n)) return "-";
    std::string s = fmt::format("{:.0f}", n);
    for (auto at = std::ptrdiff_t(s.size()) - 3; at > (n < 0); at -= 3) s.insert(std::size_t(at), "\u202f");
    return s;
}

double at(const Json& j, std::initializer_list<const char*> path)
{
    const Json* here = &j;
    for (const char* key : path) {
        if (!here->is_object() || !here->contains(key)) return std::nan("");
        here = &(*here)[key];
    }
    return here->is_number() ? usable(here->get<double>()) : std::nan("");
}

bool more(double x, double y) { return std::isgreater(x, y); }
double ratio(double a, double b) { return more(b, 0) ? a / b : std::nan(""); }

std::string word(const Json& j, const char* key)
{
    return j.is_object() && j.contains(key) && j[key].is_string() ? j[key].get<std::string>() : std::string();
}

std::string fixed(double seconds) { return std::fabs(seconds) < 1e12 ? fmt::format("{:.3f}", seconds) : "-"; }

std::vector<std::string> strings(const Json& j, const char* key)
{
    std::vector<std::string> out;
    if (j.contains(key) && j[key].is_array())
        for (const auto& e : j[key])
            if (e.is_string()) out.push_back(e.get<std::string>());
    return out;
}

std::span<const double> column(const Table& t, const char* name)
{
    const auto c = t.find(name);
    return c == t.end() ? std::span<const double>{} : std::span<const double>(c->second);
}
double last(const Table& t, const char* name)
{
    const auto c = column(t, name);
    return c.empty() ? std::nan("") : c.back();
}
std::vector<Curve> curves(const Table& t, std::initializer_list<std::pair<const char*, const char*>> wanted)
{
    std::vector<Curve> out;
    for (const auto& [name, label] : wanted)
        if (const auto c = column(t, name); !c.empty()) out.push_back({label, c});
    return out;
}

} // namespace kuzure::report
