#include "io/picture_series.hpp"
#include "io/snapshot.hpp"
#include "io/soil_color.hpp"
#include "solver/core/ensure.hpp"
#include <algorithm>
#include <cstring>
#include <fmt/format.h>
#include <mutex>
#include <nlohmann/json.hpp>

namespace kuzure::io {
namespace {

constexpr std::size_t keep_bytes = std::size_t(1) << 28; // of soil read once and drawn later, on each rank

// The HDF5 library is not for several threads at once.
std::mutex hdf5;

struct State {
    int number;
    Place file;
    double time = -HUGE_VAL; // s; that of a damaged one stays
    bool mine = false, kept = false, damaged = false;
    SoilColor::Soil soil{};
};

/// Where the snapshots of a run are; in a held directory held too.
Place snapshots_of(const Place& results)
{
    const Place place = results / "snapshots";
    return results.held() ? hold(place) : place;
}

std::vector<State> states_of(const Team& team, const Place& results)
{
    Place snapshots;
    std::string found;
    on_root(team, [&] {
        nlohmann::json numbers = nlohmann::json::array();
        if (const Place there = results / "snapshots"; exists(there))
            for (const auto& name : names_in(snapshots_of(results)))
                if (const auto n = snapshot_number(name)) numbers.push_back(*n);
        if (numbers.empty()) throw IoFailed(fmt::format("{}: no snapshot is there: run the scene again", (results / "snapshots").string()));
        found = numbers.dump();
    });
    std::string complaint;
    try {
        snapshots = snapshots_of(results);
    } catch (const IoFailed& e) {
        complaint = e.what();
    }
    agree(team, complaint);
    std::vector<State> all;
    for (const auto& n : nlohmann::json::parse(team.broadcast(found)))
        all.push_back({n.get<int>(), snapshots / fmt::format("state_{:06d}.hdf", n.get<int>())});
    return all;
}

Reach over_ranks(const Team& team, const Reach& r)
{
    double low[] = {r.all.low.x, r.all.low.y, r.all.low.z, r.core.low.x, r.core.low.y, r.core.low.z, r.least, r.percent_1};
    double high[] = {r.all.high.x, r.all.high.y, r.all.high.z, r.core.high.x, r.core.high.y, r.core.high.z, r.most, r.percent_99};
    team.min(std::span<double>(low));
    team.max(std::span<double>(high));
    return {{{low[0], low[1], low[2]}, {high[0], high[1], high[2]}},
            {{low[3], low[4], low[5]}, {high[3], high[4], high[5]}},
            low[6],
            high[6],
            low[7],
            high[7]};
}

/// Decimals that tell the times of a run's snapshots apart.
int decimals(const std::vector<State>& states)
{
    double gap = HUGE_VAL, last = -HUGE_VAL;
    for (const auto& s : states) {
        if (s.damaged) continue;
        if (s.time > last) gap = std::min(gap, s.time - last);
        last = std::max(last, s.time);
    }
    return std::isfinite(gap) ? std::clamp(int(std::ceil(-std::log10(gap) - 1e-6)), 2, 9) : 3;
}

std::vector<Vector> walls_of(const Place& state)
{
    const Place alone = state.beside("walls.hdf");
    const std::lock_guard lock(hdf5);
    return read_walls(H5Reader(exists(alone) ? alone : state));
}

} // namespace

Place picture_file(const Place& results, int number) { return results / fmt::format("picture_{:06d}.png", number); }

std::optional<int> picture_number(const Path& file)
{
    const std::string name = file.filename().string();
    if (name.size() != 18 || !name.starts_with("picture_") || !name.ends_with(".png") || name.find_first_not_of("0123456789", 8) != 14)
        return {};
    return std::stoi(name.substr(8, 6));
}

void remove_pictures(const Team& team, const Place& results)
{
    if (!can_draw()) Canvas(1, 1); // says why and what helps
    on_root(team, [&] {
        for (const auto& name : names_in(results))
            if (picture_number(name)) remove_file(results / name);
    });
}

Drawn draw_pictures(const Team& team, const PictureTask& task)
{
    if (!can_draw()) Canvas(1, 1); // says why and what helps
    auto states = states_of(team, task.results);
    const bool flat = task.dimensions == 2;
    const scene::View view = flat ? scene::View::Side : task.view;
    const bool cut = view == scene::View::Cut;

    // The first good snapshot knows what there is to show; it is known to all from here on.
    std::size_t first = 0;
    double middle = 0; // m, where the slice is cut
    on_root(team, [&] {
        for (;; ++first) {
            try {
                const H5Reader in(states[first].file);
                const SoilColor color(in, task.color);
                if (!cut) break;
                const auto soil = color.read(in);
                const Reach r = reach_of(soil.positions, {});
                if (!r.all.empty()) middle = 0.5 * (r.all.low.y + r.all.high.y);
                break;
            } catch (const IoFailed&) {
                if (!task.tolerant || first + 1 == states.size()) throw;
            }
        }
    });
    first = std::size_t(team.max(std::int64_t(first)));
    middle = team.max(team.rank() == 0 ? middle : -HUGE_VAL);
    const auto in_slice = [&](const Vector& p) { return !cut || std::fabs(p.y - middle) <= task.spacing; };

    std::string complaint; // the first of this rank
    std::vector<std::string> warnings;
    std::mutex saying;
    const auto complain = [&](std::string& to, const std::string& what) {
        const std::lock_guard lock(saying);
        if (to.empty()) to = what;
    };
    std::optional<SoilColor> color;
    try {
        color.emplace(H5Reader(states[first].file), task.color);
    } catch (const std::exception& e) {
        complaint = e.what();
    }
    agree(team, complaint);

    // Once over all states: how far the soil comes, and between which values.
    const auto read = [&](State& s) {
        SoilColor::Soil soil;
        {
            const std::lock_guard lock(hdf5);
            soil = color->read(H5Reader(s.file));
        }
        s.time = soil.time;
        return soil;
    };
    const auto n = int(states.size()), me = team.rank(), ranks = team.size();
    std::vector<Reach> reach(states.size()), broken(states.size());
    std::size_t kept = 0;
#pragma omp parallel for schedule(dynamic, 1)
    for (int k = me; k < n; k += ranks) {
        State& s = states[std::size_t(k)];
        s.mine = true;
        try {
            auto soil = read(s);
            std::vector<double> values;
            std::vector<Vector> positions;
            for (std::size_t i = 0; i < soil.positions.size(); ++i)
                if (in_slice(soil.positions[i])) values.push_back(soil.values[i]), positions.push_back(soil.positions[i]);
            (soil.broken ? broken : reach)[std::size_t(k)] = reach_of(soil.positions, values);
            soil.positions = std::move(positions), soil.values = std::move(values);
            const std::lock_guard lock(saying);
            kept += soil.values.size() * (sizeof(Vector) + sizeof(double));
            if (kept <= keep_bytes) s.soil = std::move(soil), s.kept = true;
        } catch (const IoFailed& e) {
            s.damaged = true;
            const std::lock_guard lock(saying);
            if (task.tolerant) warnings.push_back(fmt::format("no picture of a damaged snapshot: {}", e.what()));
            else if (complaint.empty()) complaint = e.what();
        } catch (const std::exception& e) {
            complain(complaint, e.what());
        }
    }
    agree(team, complaint);
    std::vector<double> times;
    for (const auto& s : states) times.push_back(s.time);
    team.max(std::span<double>(times));
    for (std::size_t k = 0; k < states.size(); ++k) states[k].time = times[k], states[k].damaged = times[k] == -HUGE_VAL;
    Reach all, failed;
    for (const auto& r : reach) all = joined(all, r);
    for (const auto& r : broken) failed = joined(failed, r);
    all = over_ranks(team, all), failed = over_ranks(team, failed);
    // Of a state whose numbers failed, positions and values can be anything.
    if (all.all.empty()) all = failed;

    const int digits = decimals(states);
    const Place first_file = states[first].file;
    if (task.at) {
        std::size_t next = 0;
        double begin = HUGE_VAL, end = -HUGE_VAL;
        for (const auto& s : states)
            if (!s.damaged) begin = std::min(begin, s.time), end = std::max(end, s.time);
        const double at = std::isinf(*task.at) ? end : *task.at, slack = 1e-9 * std::max(std::fabs(begin), std::fabs(end));
        if (!(at >= begin - slack && at <= end + slack))
            throw BadInput(fmt::format("--at {:g}: expected a time from {:g} to {:g} s, between the first and the last snapshot of {}", at,
                                       begin, end, task.results.string()));
        for (std::size_t k = 0; k < states.size(); ++k)
            if (states[k].damaged == false && (states[next].damaged || std::fabs(states[k].time - at) < std::fabs(states[next].time - at)))
                next = k;
        for (std::size_t k = 0; k < states.size(); ++k) states[k].mine = k == next && me == 0;
        states = {std::move(states[next])};
    }

    Drawn drawn;
    std::vector<State*> mine;
    for (auto& s : states) {
        if (s.damaged) continue;
        drawn.files.push_back((task.file ? task.file(s.number) : picture_file(task.results, s.number)).path());
        if (s.mine) mine.push_back(&s);
    }
    if (!mine.empty()) try {
            const auto walls = walls_of(first_file);
            const Extent frame = frame_of(all, reach_of(walls, {}).all, task.dimensions, task.spacing);
            const ColorRange range = color_range(all, color->has_signs(), task.range);
            const auto painter_with = [&](const std::vector<Vector>& all_walls) {
                std::vector<Vector> shown;
                for (const Vector& w : all_walls)
                    if (in_slice(w)) shown.push_back(w);
                return Painter(stage_of(frame, view), range, color->quantity(), task.title, task.spacing, shown, flat);
            };
            // Walls that events change are in every snapshot.
            const bool walls_change = !exists(first_file.beside("walls.hdf")) && !walls.empty();
            const Painter painter = painter_with(walls);
            if (me == 0 && !painter.missing().empty())
                warnings.push_back(
                    fmt::format("no font here has \"{}\": pictures show boxes. Remedy: apt-get install fonts-ipafont-gothic, or "
                                "another font that has them, then kuzure picture {}",
                                painter.missing(), task.results.string()));
#pragma omp parallel for schedule(dynamic, 1)
            for (std::size_t k = 0; k < mine.size(); ++k) {
                State& s = *mine[k];
                try {
                    if (!s.kept) {
                        s.soil = read(s);
                        std::size_t to = 0;
                        for (std::size_t i = 0; i < s.soil.positions.size(); ++i)
                            if (in_slice(s.soil.positions[i]))
                                s.soil.positions[to] = s.soil.positions[i], s.soil.values[to++] = s.soil.values[i];
                        s.soil.positions.resize(to), s.soil.values.resize(to);
                    }
                    const Moment moment{s.soil.positions, s.soil.values, fmt::format("t = {:.{}f} s", s.time, digits), s.soil.failed};
                    write_lightly(task.file ? task.file(s.number) : picture_file(task.results, s.number),
                                  walls_change ? painter_with(walls_of(s.file)).draw(moment) : painter.draw(moment));
                    s.soil = {};
                } catch (const std::exception& e) {
                    complain(complaint, e.what());
                }
            }
        } catch (const std::exception& e) {
            complaint = e.what();
        }
    agree(team, complaint);

    std::string said;
    for (const auto& w : warnings) said += w + '\n';
    for (const auto& bytes : team.gather(std::as_bytes(std::span(said.data(), said.size())))) {
        std::string text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
        for (std::size_t at = 0, end; (end = text.find('\n', at)) != std::string::npos; at = end + 1)
            drawn.warnings.push_back(text.substr(at, end - at));
    }
    return drawn;
}

} // namespace kuzure::io
