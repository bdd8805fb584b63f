#include "solver/app/report/report.hpp"
#include "solver/app/report/chart.hpp"
#include "solver/app/report/page.hpp"
#include "solver/app/report/stages.hpp"
#include "solver/app/report/values.hpp"
#include "solver/core/simd.hpp"
#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace kuzure::report {

namespace {

constexpr std::uint64_t largest_picture = std::uint64_t(64) << 20, largest_movie = std::uint64_t(512) << 20; // bytes, in a page
constexpr std::size_t most_notes = 100;

/// What the run's coarser twins say of its answer; nothing without them.
std::string error_bars(const Record& r)
{
    if (!r.summary.contains("error_bars")) return {};
    const auto& bars = r.summary["error_bars"];
    std::string rows;
    for (const char* name : {"run-out", "height", "peak speed"}) {
        if (!bars.contains(name)) continue;
        const auto& bar = bars[name];
        const double value = at(bar, {"value"}), half_width = at(bar, {"half_width"});
        const std::string unit = escaped(word(bar, "unit"));
        rows += fmt::format("<tr><td>{}</td><td>{}</td></tr>", name,
                            std::isfinite(half_width)
                                ? fmt::format("{} &plusmn; {:.2g} {}", shown(value), half_width, unit)
                                : fmt::format("{} {}; no interval: {}", shown(value), unit, escaped(word(bar, "no_interval"))));
    }
    return fmt::format("<p>From the same scene at 2 and 4 times the spacing; run-out where the heap is {} m high.</p>\n<table>{}</table>\n",
                       shown(at(bars, {"grain"})), rows);
}

// ---- what happened -------------------------------------------------------------------------------------------------
struct Verdict {
    const char* tone; // good, warn, bad
    std::string words, reason;
};

Verdict verdict(const Record& r)
{
    const std::string status = r.text("status"), message = r.text("message");
    double t = r.number("time");
    if (!std::isfinite(t)) t = last(r.history, "time");
    const std::string of = r.end_time && std::isfinite(t) ? fmt::format(" of {:g} s ({:.0f} %)", *r.end_time, 100 * t / *r.end_time) : " s";
    const std::string when = std::isfinite(t) ? fmt::format("t = {:g}{}", t, r.end_time ? " s" + of : of) : "the beginning";
    if (status == "finished") return {"good", fmt::format("Finished: the run reached its end, t = {} s.", shown(t)), message};
    if (status == "stopped")
        return {"warn", fmt::format("Stopped on request at {} (exit code 5).", when),
                "A checkpoint was written: kuzure run with --restart goes on from it, to the same bits as a run never stopped."};
    if (status == "numbers failed")
        return {"bad", fmt::format("Failed at {}: the numbers broke (exit code 3). What follows the last rows is not to be used.", when),
                message};
    if (!status.empty()) return {"bad", fmt::format("Ended as \"{}\" at {}.", status, when), message};
    return {"warn", fmt::format("No end was recorded: the run goes on, or was killed. Its last row is at {}.", when),
            "kuzure run with --restart goes on from the newest good checkpoint."};
}

std::string opening(const Record& r)
{
    const Verdict v = verdict(r);
    std::string s =
        fmt::format("<header>\n<h1>{}</h1>\n<div class=\"verdict {}\"><strong>{}</strong>", escaped(r.title), v.tone, escaped(v.words));
    if (!v.reason.empty()) s += "<p>" + escaped(v.reason) + "</p>";
    double residual = at(r.summary, {"energy", "residual"});
    if (!std::isfinite(residual)) residual = last(r.history, "residual");
    if (std::isfinite(residual))
        s += fmt::format("<p>Energy: {:+.3f} % of the potential drop is unaccounted for{}</p>", 100 * residual,
                         std::fabs(residual) < 0.01   ? ", below 1 %: good."
                         : std::fabs(residual) < 0.05 ? ". Between 1 and 5 %: compare with half the step."
                                                      : ". Above 5 %: look at the step and the viscosity before you use this result.");
    s += "</div>\n<dl class=\"cards\">";
    const double wall = r.number("wall_seconds"), predicted = r.number("predicted_seconds");
    s += card("simulated", fmt::format("{} s", shown(std::isfinite(r.number("time")) ? r.number("time") : last(r.history, "time"))),
              grouped(std::isfinite(r.number("steps")) ? r.number("steps") : last(r.history, "step")) + " steps");
    // What was predicted is the whole run.
    std::string before = more(predicted, 0) ? "predicted " + duration(predicted) : "";
    if (more(predicted, 0) && more(wall, 0))
        before += r.text("status") == "finished" ? fmt::format(" ({:+.0f}\u00a0%)", 100 * (predicted / wall - 1)) : " for all of it";
    s += card("wall time", duration(wall), before);
    s += card("soil particles", grouped(r.number("soil_particles")), grouped(r.number("wall_particles")) + " of walls");
    s += card("ranks \u00d7 threads", grouped(r.number("ranks")) + " \u00d7 " + grouped(r.number("threads")), r.text("precision"));
    s += card("speed", shown(r.number("particle_steps_per_second"), true) + "/s", "soil-particle steps");
    s += card("height", shown(last(r.history, "height")) + " m", "at the last row");
    if (const double off = r.number("soil_off_ground"); more(off, 0))
        s += card("off the ground", fmt::format("{:.3g} %", 100 * off), "of the soil, below or beyond all walls");
    s += card("front along x", fmt::format("{} to {} m", shown(last(r.history, "front_min_x")), shown(last(r.history, "front_max_x"))));
    if (!r.flat)
        s += card("front along y", fmt::format("{} to {} m", shown(last(r.history, "front_min_y")), shown(last(r.history, "front_max_y"))));
    s += "</dl>\n</header>\n";
    std::string notes;
    const auto warnings = strings(r.summary, "warnings");
    for (std::size_t k = 0; k < std::min(warnings.size(), most_notes); ++k) notes += "<li>" + escaped(warnings[k]) + "</li>";
    if (warnings.size() > most_notes) notes += fmt::format("<li>and {} more in summary.json</li>", warnings.size() - most_notes);
    if (r.summary.contains("retries") && r.summary["retries"].is_array())
        for (const auto& retry : r.summary["retries"])
            if (retry.is_object())
                notes += fmt::format("<li>went back to t = {} s and on with half the step: {}</li>", shown(at(retry, {"from_time"})),
                                     escaped(word(retry, "message")));
    for (const auto& g : r.gaps) notes += "<li>" + escaped(g) + "</li>";
    return s + section("warnings", "Warnings", notes.empty() ? "<p class=\"soft\">None.</p>\n" : "<ul>" + notes + "</ul>\n");
}

// ---- pictures and curves -------------------------------------------------------------------------------------------
std::string pictures(const Record& r)
{
    if (r.pictures.empty())
        return "<p class=\"soft\">None: the scene has no <code>picture</code> in [output], or the run has not come to its end. "
               "<code>kuzure picture DIR</code> draws them from the snapshots.</p>\n";
    const std::size_t end = r.pictures.size() - 1;
    const bool failed = r.text("status") == "numbers failed";
    std::vector<std::size_t> show{0, end / 2, end};
    if (failed) show = {0, end - std::min<std::size_t>(end, 1), end};
    show.erase(std::unique(show.begin(), show.end()), show.end());
    std::string s = "<div class=\"pictures\">\n";
    for (const std::size_t k : show) {
        const double t = r.picture_times[k];
        const char* which = failed && k == end       ? "the moment of failure, the particle named above in the red ring"
                            : k == 0                 ? "start"
                            : failed && k + 1 == end ? "the last picture before it"
                            : k == end               ? "end"
                                                     : "during";
        const std::string caption = std::isfinite(t) ? fmt::format("{}, t = {:.4g} s", which, t) : which;
        try {
            s += fmt::format(
                "<figure><img alt=\"{0}\" src=\"{1}\"><figcaption>{0}</figcaption></figure>\n", escaped(caption),
                data_uri("image/png", io::read_text(io::hold(r.directory) / r.pictures[k].filename().string(), largest_picture)));
        } catch (const IoFailed& e) {
            s += "<p>" + escaped(e.what()) + "</p>";
        }
    }
    if (!r.movie.empty()) {
        try {
            const bool gif = r.movie.extension() == ".gif", webm = r.movie.extension() == ".webm";
            const std::string uri = data_uri(gif    ? "image/gif"
                                             : webm ? "video/webm"
                                                    : "video/mp4",
                                             io::read_text(io::hold(r.directory) / r.movie.filename().string(), largest_movie));
            s += gif ? fmt::format("<figure><img alt=\"animation\" src=\"{}\"><figcaption>all pictures</figcaption></figure>\n", uri)
                     : fmt::format("<figure><video controls loop muted src=\"{}\"></video><figcaption>all pictures</figcaption></figure>\n",
                                   uri);
        } catch (const IoFailed& e) {
            s += "<p>" + escaped(e.what()) + "</p>";
        }
    }
    return s + "</div>\n";
}

/// What came where: nothing where the scene has no maps.
std::string maps(const Record& r)
{
    if (!r.summary.contains("maps") || !r.summary["maps"].is_object()) return {};
    const auto& m = r.summary["maps"];
    std::string s = "<dl class=\"cards\">";
    s += card("reached", grouped(at(m, {"area_reached"})) + " m\u00b2", fmt::format("at least {} m thick", shown(at(m, {"wet"}))));
    s += card("greatest thickness", shown(at(m, {"h_max"})) + " m", fmt::format("of a cell of {} m", shown(at(m, {"cell"}))));
    s += card("greatest speed", shown(at(m, {"v_max"})) + " m/s", "mean over the depth");
    s += card("soil on the maps", shown(at(m, {"volume"})) + " m\u00b3",
              more(at(m, {"volume_beyond"}), 0) ? shown(at(m, {"volume_beyond"})) + " m\u00b3 beyond them" : "none beyond them");
    s += "</dl>\n<div class=\"pictures\">\n";
    for (const auto& [name, caption] : {std::pair{"h_max", "greatest thickness"}, std::pair{"t_arrival", "arrival"}}) {
        try {
            const auto folder = io::hold(io::hold(r.directory) / "maps");
            const auto file = folder / (std::string(name) + ".png");
            if (!io::exists(file)) continue;
            s += fmt::format("<figure><img alt=\"{0}\" src=\"{1}\"><figcaption>{0}</figcaption></figure>\n", caption,
                             data_uri("image/png", io::read_text(file, largest_picture)));
        } catch (const IoFailed& e) {
            s += "<p>" + escaped(e.what()) + "</p>";
        }
    }
    const std::string crs = word(m, "crs");
    return s +
           fmt::format("</div>\n<p class=\"soft small\">{}. The rasters are in <code>maps/</code>, with styles for QGIS; docs/maps.md says "
                       "what each holds.</p>\n",
                       crs.empty() ? "Coordinates of the scene" : "Coordinates in " + escaped(crs));
}

std::string energy(const Record& r)
{
    const auto t = column(r.history, "time");
    std::vector<double> percent;
    for (const double v : column(r.history, "residual")) percent.push_back(100 * v);
    auto accounts = curves(r.history, {{"kinetic", "kinetic"},
                                       {"potential", "potential"},
                                       {"elastic", "elastic"},
                                       {"plastic", "plastic"},
                                       {"viscous", "viscous"},
                                       {"wall", "wall"},
                                       {"damping", "damping"}});
    // of stages, where there are some
    for (const auto& curve : curves(r.history, {{"moved_wall", "moved walls"}, {"events", "events"}, {"loads", "loads"}}))
        if (std::ranges::any_of(curve.y, [](double joules) { return std::fabs(joules) > 0; })) accounts.push_back(curve);
    return "<div class=\"pair\">\n" + chart("Energies", "time", "s", t, r.flat ? "J/m" : "J", accounts) +
           chart("Energy residual", "time", "s", t, "%", {{"share of the potential drop", percent}}) + "</div>\n";
}

std::string heap(const Record& r)
{
    const auto t = column(r.history, "time");
    std::vector<double> steps(column(r.history, "dt").begin(), column(r.history, "dt").end());
    std::replace(steps.begin(), steps.end(), 0.0, std::nan("")); // before the first step there is none
    const auto fronts =
        r.flat
            ? curves(r.history, {{"front_min_x", "low x"}, {"front_max_x", "high x"}})
            : curves(r.history, {{"front_min_x", "low x"}, {"front_max_x", "high x"}, {"front_min_y", "low y"}, {"front_max_y", "high y"}});
    return "<div class=\"pair\">\n" + chart("Fronts", "time", "s", t, "m", fronts, false) +
           chart("Height of the soil", "time", "s", t, "m", curves(r.history, {{"height", "height"}})) +
           chart("Fastest particle", "time", "s", t, "m/s", curves(r.history, {{"max_speed", "speed"}})) +
           chart("Time step", "time", "s", t, "s", {{"step", steps}}) + "</div>\n";
}

// ---- time spent ----------------------------------------------------------------------------------------------------
std::string phases(const Record& r)
{
    if (!r.timers.contains("phases") || !r.timers["phases"].is_object())
        return "<p class=\"soft\">No times by phase were written: that is done at the end of a run.</p>\n";
    const bool ranks = more(at(r.timers, {"ranks"}), 1);
    std::string s = std::string("<div class=\"scroll\"><table><thead><tr><th>phase</th><th>share</th><th></th><th>mean s</th>") +
                    (ranks ? "<th>least s</th><th>most s</th>" : "") +
                    "<th>calls</th><th>Gflop/s</th><th>GB/s</th><th>flop/byte</th></tr></thead><tbody>\n";
    const auto row = [&](const std::string& name, const Json& p, const char* kind) {
        const double share = std::fmin(1, std::fmax(0, at(p, {"share"}))), gflops = at(p, {"gflop_per_second"}),
                     gbytes = at(p, {"gbyte_per_second"}), intensity = at(p, {"flop_per_byte"});
        const auto or_nothing = [](double v) { return std::isfinite(v) ? shown(v) : std::string(); };
        s += fmt::format("<tr{}><td>{}</td><td>{:.1f} %</td><td class=\"bars\"><span class=\"bar\" style=\"width:{:.1f}%\"></span></td>"
                         "<td>{}</td>",
                         kind, escaped(name), 100 * share, std::min(100 * share, 100.0), fixed(at(p, {"seconds", "mean"})));
        if (ranks) s += fmt::format("<td>{}</td><td>{}</td>", fixed(at(p, {"seconds", "min"})), fixed(at(p, {"seconds", "max"})));
        s += fmt::format("<td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>\n",
                         more(at(p, {"calls"}), 0) ? grouped(at(p, {"calls"})) : std::string(), or_nothing(gflops), or_nothing(gbytes),
                         or_nothing(intensity));
    };
    std::vector<std::pair<double, std::string>> order;
    for (const auto& [name, p] : r.timers["phases"].items()) order.emplace_back(-std::fmax(0, at(p, {"share"})), name);
    std::sort(order.begin(), order.end());
    for (const auto& [share, name] : order) row(name, r.timers["phases"][name], "");
    if (r.timers.contains("total")) row("total", r.timers["total"], " class=\"sum\"");
    const double pairs = at(r.timers, {"pairs"}), steps = at(r.timers, {"particle_steps"});
    s += "</tbody></table></div>\n";
    s += fmt::format(
        "<p class=\"soft small\">{} directed pairs, {} a soil particle and step; {} ns a pair in the pair loop. The times are those of "
        "the last start of the program.</p>\n",
        grouped(pairs), shown(ratio(pairs, steps)), shown(ratio(1e9 * at(r.timers, {"pair_loop", "seconds", "max"}), pairs)));
    return s;
}

std::string roofs(const Record& r)
{
    std::vector<Dot> dots;
    if (r.timers.contains("phases") && r.timers["phases"].is_object())
        for (const auto& [name, p] : r.timers["phases"].items())
            if (const double x = at(p, {"flop_per_byte"}), y = at(p, {"gflop_per_second"});
                more(x, 1e-9) && more(y, 1e-9) && x < 1e9 && y < 1e12)
                dots.push_back({name, x, y});
    if (dots.empty()) return "<p class=\"soft\">No phase has counted its operations.</p>\n";
    const bool single = r.text("precision") == "mixed";
    const double nodes = std::isfinite(r.number("hosts")) ? r.number("hosts") : 1;
    const double flops = nodes * at(r.timers, {"machine", single ? "gflops_float_all" : "gflops_double_all"}),
                 bytes = nodes * at(r.timers, {"machine", "gbytes_all"});
    std::optional<Roofs> machine;
    if (more(flops, 1e-6) && more(bytes, 1e-6) && flops < 1e15 && bytes < 1e15)
        machine = Roofs{flops, bytes, single ? "multiply-add, single" : "multiply-add, double"};
    std::string s = "<div class=\"pair\">\n" + roofline(machine ? &*machine : nullptr, dots) + "<div class=\"small soft\">";
    if (machine)
        s += fmt::format(
            "<p>The roofs were measured on {} ({}): chained fused multiply-adds in registers, and a(i) = b(i) + s c(i) over arrays "
            "larger than the caches, all threads of the run at once.</p>",
            escaped(word(r.timers["machine"], "host")), escaped(word(r.timers["machine"], "cpu")));
    else
        s += "<p>The roofs of this machine have not been measured yet: <code>kuzure report</code> does it there, in about two seconds, and "
             "keeps them.</p>";
    return s +
           "<p>Operations and bytes are those the loops declare: additions, multiplications, divisions and roots of every pair inside the "
           "support (square roots and divisions count as one), and the columns, records and lists that must come from memory. "
           "docs/performance.md compares the declaration with the processor's instructions.</p></div></div>\n";
}

std::string balance(const Record& r)
{
    const auto t = column(r.progress, "time");
    if (t.empty()) return "<p class=\"soft\">No progress.csv: nothing is known of the speed over time.</p>\n";
    std::string s = "<div class=\"pair\">\n" +
                    chart("Steps a second", "time", "s", t, "1/s", curves(r.progress, {{"steps_per_second", "steps a second"}}));
    if (more(r.number("ranks"), 1))
        s += chart("Balance: busiest rank over the mean", "time", "s", t, "1", curves(r.progress, {{"balance", "max/mean"}}), false);
    s += "</div>\n";
    if (!more(r.number("ranks"), 1)) s += "<p class=\"soft small\">One rank: there is nothing to balance.</p>\n";
    return s;
}

// ---- other parts ---------------------------------------------------------------------------------------------------
std::string effects(const Record& r)
{
    std::string rows;
    if (r.summary.contains("effects") && r.summary["effects"].is_object())
        for (const char* which : {"on", "off"})
            if (const auto& e = r.summary["effects"]; e.contains(which) && e[which].is_array())
                for (const auto& effect : e[which])
                    if (effect.is_object()) {
                        std::string name = word(effect, "name");
                        std::replace(name.begin(), name.end(), '_', ' ');
                        rows += fmt::format("<tr><td><span class=\"tag {0}\">{0}</span> {1}</td><td>{2}</td></tr>\n", which, escaped(name),
                                            escaped(word(effect, "why")));
                    }
    if (rows.empty()) return "<p class=\"soft\">Unknown: they stand in summary.json.</p>\n";
    return "<table class=\"text\"><thead><tr><th>effect</th><th>why</th></tr></thead><tbody>\n" + rows + "</tbody></table>\n";
}

std::string provenance(const Record& r)
{
    std::string rows;
    const auto row = [&](const char* name, const std::string& value) {
        if (!value.empty() && value != "-") rows += fmt::format("<tr><td>{}</td><td>{}</td></tr>\n", name, escaped(value));
    };
    row("program", r.text("version"));
    row("host", r.text("host"));
    row("pair model", r.text("pair_model"));
    row("scene hash", r.text("scene_hash"));
    row("state hash", r.text("state_hash"));
    row("list rebuilds, new cuts", grouped(r.number("rebuilds")) + ", " + grouped(r.number("repartitions")));
    row("memory of a rank", shown(r.number("memory_bytes_per_rank"), true) + "B");
    row("directory", r.directory.string());
    return "<table class=\"text\"><tbody>\n" + rows + "</tbody></table>\n";
}

} // namespace

std::string html(const Record& r)
{
    std::string s = opening(r);
    s += section("pictures", "Pictures", pictures(r));
    s += section("maps", "Maps", maps(r));
    s += section("stages", "Events, loads, forces on walls", stages(r));
    s += section("energy", "Energy", energy(r));
    s += section("heap", "The heap", heap(r));
    s += section("error-bars", "The answer and its error bars", error_bars(r));
    s += section("phases", "Where the time went", phases(r));
    s += section("roofline", "Against the machine", roofs(r));
    s += section("balance", "Speed and balance over time", balance(r));
    s += section("effects", "What was simulated, and why", effects(r));
    s += section("provenance", "How to get it again", provenance(r));
    s += section("scene", "The scene",
                 r.scene.empty() ? "<p class=\"soft\">Unknown.</p>\n"
                                 : "<details open><summary>scene.toml, every default written out</summary><pre>" + escaped(r.scene) +
                                       "</pre></details>\n");
    return page(r.title, s);
}

void add_roofs(const io::Path& directory)
{
    const Record r = read_record(directory);
    if (r.timers.empty() || r.timers.contains("machine") || r.text("host") != host_name()) return;
    const double hosts = std::fmax(1, r.number("hosts")), threads = r.number("ranks") * r.number("threads") / hosts;
    if (!std::isgreaterequal(threads, 1) || threads > 65536) return;
    auto timers = nlohmann::ordered_json::parse(io::read_text(directory / "timers.json"));
    timers["machine"] = nlohmann::ordered_json::parse(to_json(this_machine(instruction_set(), int(threads))));
    io::write_atomically(directory / "timers.json", timers.dump(2) + "\n");
}

io::Path write_report(const io::Path& directory)
{
    const io::Path file = directory / "report.html";
    io::write_atomically(file, html(read_record(directory)));
    return file;
}

} // namespace kuzure::report
