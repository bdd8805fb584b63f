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

/// True where events change walls, and every snapshot has its own.
bool have_walls_of_their_time(const Place& state)
{
    const std::lock_guard lock(hdf5);
    return H5Reader(state).has_attribute("/VTKHDF", "walls_change");
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

namespace {

/// The pictures of one task, drawn by all ranks: each reads and draws every so many states.
class Series {
public:
    Series(const Team& team, const PictureTask& task)
        : team_(team), task_(task), states_(states_of(team, task.results)), flat_(task.dimensions == 2),
          view_(flat_ ? scene::View::Side : task.view)
    {
    }
    Drawn draw()
    {
        find_first();
        open_color();
        first_file_ = states_[first_].file;
        const Reach all = survey();
        digits_ = decimals(states_);
        if (task_.at) keep_only(*task_.at);
        Drawn drawn;
        for (const auto& s : states_)
            if (!s.damaged) drawn.files.push_back(file_of(s).path());
        try {
            paint(all);
        } catch (const std::exception& e) {
            complaint_ = e.what();
        }
        agree(team_, complaint_);
        drawn.warnings = all_warnings();
        return drawn;
    }

private:
    /// What all pictures share.
    struct Framing {
        Extent frame;
        ColorRange range;
    };
    bool in_slice(const Vector& p) const { return view_ != scene::View::Slice || std::fabs(p.y - middle_) <= task_.spacing; }
    Place file_of(const State& s) const { return task_.file ? task_.file(s.number) : picture_file(task_.results, s.number); }
    void complain(const std::string& what)
    {
        const std::lock_guard lock(saying_);
        if (complaint_.empty()) complaint_ = what;
    }
    SoilColor::Soil read(State& s) const
    {
        SoilColor::Soil soil;
        {
            const std::lock_guard lock(hdf5);
            soil = color_->read(H5Reader(s.file));
        }
        s.time = soil.time;
        return soil;
    }

    /// The first good snapshot knows what there is to show; it is known to all from here on.
    void find_first()
    {
        on_root(team_, [&] {
            for (;; ++first_) {
                try {
                    const H5Reader in(states_[first_].file);
                    const SoilColor color(in, task_.color);
                    if (view_ != scene::View::Slice) break;
                    const auto soil = color.read(in);
                    const Reach r = reach_of(soil.positions, {});
                    if (!r.all.empty()) middle_ = 0.5 * (r.all.low.y + r.all.high.y);
                    break;
                } catch (const IoFailed&) {
                    if (!task_.tolerant || first_ + 1 == states_.size()) throw;
                }
            }
        });
        first_ = std::size_t(team_.max(std::int64_t(first_)));
        middle_ = team_.max(team_.rank() == 0 ? middle_ : -HUGE_VAL);
    }

    void open_color()
    {
        try {
            color_.emplace(H5Reader(states_[first_].file), task_.color);
        } catch (const std::exception& e) {
            complaint_ = e.what();
        }
        agree(team_, complaint_);
    }

    /// Once over all states: how far the soil comes, and between which values.
    Reach survey()
    {
        std::vector<Reach> reach(states_.size()), broken(states_.size());
        const int n = int(states_.size()), me = team_.rank(), ranks = team_.size();
#pragma omp parallel for schedule(dynamic, 1)
        for (int k = me; k < n; k += ranks) survey(states_[std::size_t(k)], reach[std::size_t(k)], broken[std::size_t(k)]);
        agree(team_, complaint_);
        std::vector<double> times;
        for (const auto& s : states_) times.push_back(s.time);
        team_.max(std::span<double>(times));
        for (std::size_t k = 0; k < states_.size(); ++k) states_[k].time = times[k], states_[k].damaged = times[k] == -HUGE_VAL;
        Reach all, failed;
        for (const auto& r : reach) all = joined(all, r);
        for (const auto& r : broken) failed = joined(failed, r);
        all = over_ranks(team_, all), failed = over_ranks(team_, failed);
        // Of a state whose numbers failed, positions and values can be anything.
        return all.all.empty() ? failed : all;
    }
    void survey(State& s, Reach& reach, Reach& broken)
    {
        s.mine = true;
        try {
            auto soil = read(s);
            std::vector<double> values;
            std::vector<Vector> positions;
            for (std::size_t i = 0; i < soil.positions.size(); ++i)
                if (in_slice(soil.positions[i])) values.push_back(soil.values[i]), positions.push_back(soil.positions[i]);
            (soil.broken ? broken : reach) = reach_of(soil.positions, values);
            soil.positions = std::move(positions), soil.values = std::move(values);
            const std::lock_guard lock(saying_);
            kept_ += soil.values.size() * (sizeof(Vector) + sizeof(double));
            if (kept_ <= keep_bytes) s.soil = std::move(soil), s.kept = true;
        } catch (const IoFailed& e) {
            s.damaged = true;
            const std::lock_guard lock(saying_);
            if (task_.tolerant) warnings_.push_back(fmt::format("no picture of a damaged snapshot: {}", e.what()));
            else if (complaint_.empty()) complaint_ = e.what();
        } catch (const std::exception& e) {
            complain(e.what());
        }
    }

    /// The state that is nearest to a time (s), for the root to draw.
    void keep_only(double wanted)
    {
        std::size_t next = 0;
        double begin = HUGE_VAL, end = -HUGE_VAL;
        for (const auto& s : states_)
            if (!s.damaged) begin = std::min(begin, s.time), end = std::max(end, s.time);
        const double at = std::isinf(wanted) ? end : wanted, slack = 1e-9 * std::max(std::fabs(begin), std::fabs(end));
        if (!(at >= begin - slack && at <= end + slack))
            throw BadInput(fmt::format("--at {:g}: expected a time from {:g} to {:g} s, between the first and the last snapshot of {}", at,
                                       begin, end, task_.results.string()));
        for (std::size_t k = 0; k < states_.size(); ++k)
            if (!states_[k].damaged && (states_[next].damaged || std::fabs(states_[k].time - at) < std::fabs(states_[next].time - at)))
                next = k;
        for (std::size_t k = 0; k < states_.size(); ++k) states_[k].mine = k == next && team_.rank() == 0;
        states_ = {std::move(states_[next])};
    }

    Painter painter_with(const Framing& framing, const std::vector<Vector>& walls) const
    {
        std::vector<Vector> shown;
        for (const Vector& w : walls)
            if (in_slice(w)) shown.push_back(w);
        return Painter(stage_of(framing.frame, view_), framing.range, color_->quantity(), task_.title, task_.spacing, shown, flat_);
    }

    void paint(const Reach& all)
    {
        std::vector<State*> mine;
        for (auto& s : states_)
            if (!s.damaged && s.mine) mine.push_back(&s);
        if (mine.empty()) return;
        const auto walls = walls_of(first_file_);
        // Walls that events change are in every snapshot.
        const bool walls_change = have_walls_of_their_time(first_file_);
        const Framing framing{frame_of(all, reach_of(walls, {}).all, task_.dimensions, task_.spacing),
                              color_range(all, color_->has_signs(), task_.range)};
        const Painter painter = painter_with(framing, walls);
        if (team_.rank() == 0 && !painter.missing().empty())
            warnings_.push_back(
                fmt::format("no font here has \"{}\": pictures show boxes. Remedy: apt-get install fonts-ipafont-gothic, or "
                            "another font that has them, then kuzure picture {}",
                            painter.missing(), task_.results.string()));
#pragma omp parallel for schedule(dynamic, 1)
        for (std::size_t k = 0; k < mine.size(); ++k) {
            try {
                State& s = *mine[k];
                take_soil(s);
                const Moment moment{s.soil.positions, s.soil.values, fmt::format("t = {:.{}f} s", s.time, digits_), s.soil.failed};
                write_lightly(file_of(s), walls_change ? painter_with(framing, walls_of(s.file)).draw(moment) : painter.draw(moment));
                s.soil = {};
            } catch (const std::exception& e) {
                complain(e.what());
            }
        }
    }
    /// What is to be drawn of a state's soil, read where it was not kept.
    void take_soil(State& s) const
    {
        if (s.kept) return;
        s.soil = read(s);
        std::size_t to = 0;
        for (std::size_t i = 0; i < s.soil.positions.size(); ++i)
            if (in_slice(s.soil.positions[i])) s.soil.positions[to] = s.soil.positions[i], s.soil.values[to++] = s.soil.values[i];
        s.soil.positions.resize(to), s.soil.values.resize(to);
    }

    /// Those of all ranks, on the root.
    std::vector<std::string> all_warnings() const
    {
        std::vector<std::string> all;
        std::string said;
        for (const auto& w : warnings_) said += w + '\n';
        for (const auto& bytes : team_.gather(std::as_bytes(std::span(said.data(), said.size())))) {
            std::string text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
            for (std::size_t at = 0, end; (end = text.find('\n', at)) != std::string::npos; at = end + 1)
                all.push_back(text.substr(at, end - at));
        }
        return all;
    }

    const Team& team_;
    const PictureTask& task_;
    std::vector<State> states_;
    bool flat_;
    scene::View view_;
    std::size_t first_ = 0; // good state
    Place first_file_;
    double middle_ = 0; // m, where the slice lies
    std::optional<SoilColor> color_;
    int digits_ = 0;
    std::size_t kept_ = 0;  // bytes
    std::string complaint_; // the first of this rank
    std::vector<std::string> warnings_;
    std::mutex saying_;
};

} // namespace

Drawn draw_pictures(const Team& team, const PictureTask& task)
{
    if (!can_draw()) Canvas(1, 1); // says why and what helps
    return Series(team, task).draw();
}

} // namespace kuzure::io
