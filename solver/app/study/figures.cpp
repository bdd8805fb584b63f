// The figures of a study: data and gnuplot scripts, drawn where gnuplot is there.
#include "io/quote.hpp"
#include "solver/app/cli/program.hpp"
#include "solver/app/study/study.hpp"
#include <algorithm>
#include <fmt/format.h>
#include <fmt/ranges.h>

namespace kuzure::study {
namespace {

using io::Measure;

const char* const colours[] = {"#4477aa", "#ee6677", "#228833", "#ccbb44", "#66ccee", "#aa3377", "#888888", "#000000"};

std::string file_of(Measure m)
{
    std::string name = io::measure_names()[std::size_t(m)];
    std::replace(name.begin(), name.end(), ' ', '_'), std::replace(name.begin(), name.end(), '-', '_');
    return name;
}

const char* const style = "set encoding utf8\n"
                          "set border 3 lc rgb '#404040'; set tics nomirror out textcolor rgb '#404040'; set grid lc rgb '#e4e4e4' lw 1\n";

/// The same commands for both formats.
std::string both(const std::string& name, int width, int height, const std::string& commands)
{
    std::string out;
    for (const auto& [terminal, ending] :
         {std::pair{"pngcairo font 'DejaVu Sans,11' lw 1.3", "png"}, std::pair{"svg font 'DejaVu Sans,11' background '#ffffff'", "svg"}})
        out += fmt::format("reset\nset terminal {} size {},{} noenhanced\nset output '{}.{}'\n{}{}\nunset output\n", terminal, width,
                           height, name, ending, style, commands);
    return out;
}

/// One plot of error against cost.
std::string cost_plots(const Study& study, Measure m, const std::string& name, const std::vector<std::string>& curves, bool work)
{
    const double scatter = 100 * study.sweep.reference.scatter;
    std::string plots;
    const auto add = [&](const std::string& one) { plots += (plots.empty() ? "plot " : ", \\\n  ") + one; };
    if (scatter > 0) add(fmt::format("{:.4g} w filledcurves y1=1e-9 fc rgb '#eeeeee' t 'scatter of the experiment'", scatter));
    add(fmt::format("'{}.dat' index {} u 1:2 w l lw 7 lc rgb '#ffe08a' t 'Pareto front'", name, curves.size() + std::size_t(work)));
    add("5 w l dt 3 lc rgb '#999999' notitle"), add("1 w l dt 3 lc rgb '#999999' notitle");
    for (std::size_t i = 0; i < curves.size(); ++i) {
        std::string title = curves[i];
        if (!work)
            for (const auto& [level, text] : {std::pair{0.05, "5 %"}, std::pair{0.01, "1 %"}})
                if (const auto t = cost_at(study.prices(curves[i], m, false), level)) title += fmt::format(", {} in {:.3g} s", text, *t);
        add(fmt::format("'{}.dat' index {} u {}:3 w lp lw 2 pt 7 ps 0.8 lc rgb '{}' t {}", name, i, work ? 2 : 1, colours[i % 8],
                        io::gnuplot_string(title)));
    }
    add(fmt::format("'{}.dat' index 0 u {}:3:(sprintf('%g m', $4)) w labels offset 0,0.8 font ',8' textcolor rgb '#404040' notitle", name,
                    work ? 2 : 1));
    return plots + "\n";
}

/// Error against cost, once by core-seconds and once by work.
std::string cost_figure(const Study& study, Measure m, const io::Path& folder)
{
    const auto name = "error_" + file_of(m);
    const auto k = std::size_t(m);
    std::string data;
    std::vector<std::string> curves;
    double least = HUGE_VAL, most = 0;
    for (const auto& curve : study.curves()) {
        std::string block;
        for (const Point* p : study.along(curve))
            if (study.tells(*p, m)) {
                block += fmt::format("{:.6g} {:.6g} {:.6g} {:.6g}\n", p->core_seconds, p->work, 100 * p->error[k], p->spacing);
                least = std::min(least, 100 * p->error[k]), most = std::max(most, 100 * p->error[k]);
            }
        if (block.empty()) continue;
        data += fmt::format("# {}: core-seconds, work, error in %, spacing in m\n{}\n\n", io::comment_text(curve), block);
        curves.push_back(curve);
    }
    if (curves.empty()) return {};
    std::string fronts[2];
    for (const bool work : {false, true}) {
        std::vector<Price> all;
        for (const auto& curve : curves)
            for (const auto& p : study.prices(curve, m, work)) all.push_back(p);
        fronts[work] = "# Pareto front: cost, error in %\n";
        for (const auto i : pareto_front(all)) fronts[work] += fmt::format("{:.6g} {:.6g}\n", all[i].cost, 100 * all[i].error);
        data += fronts[work] + "\n\n";
    }
    io::write_atomically(folder / (name + ".dat"), data);

    std::string c =
        fmt::format("set multiplot layout 1,2 title {}\nset logscale xy\nset format x '10^{{%T}}'\nset bmargin 10\nset ylabel 'error of {} "
                    "(%)'\nset yrange [{:.3g}:{:.3g}]\n",
                    io::gnuplot_string(fmt::format("{}: {}", study.sweep.title, io::measure_names()[k])), io::measure_names()[k],
                    0.5 * std::min(least, 1.0), 2 * std::max(most, 5.0));
    for (const bool work : {false, true}) {
        c += fmt::format("set xlabel '{}'\n", work ? "work (pairs of the one-pass scheme)" : "core-seconds");
        c += work ? "unset key\n" : "set key at graph 0,-0.17 left top Left reverse samplen 1.5 spacing 1.1 font ',9' maxcols 1\n";
        if (!work) c += "set format x '%g'\n";
        else c += "set format x '%.0e'\n";
        c += cost_plots(study, m, name, curves, work);
    }
    c += "unset multiplot\n";
    return both(name, 1100, 580, c);
}

/// What each [[point]] costs against the base: time ratio, and error change for the study's first measure.
std::string choice_figure(const Study& study, const io::Path& folder)
{
    const Point* base = study.base();
    if (!base) return {};
    const auto m = study.sweep.measures.front();
    std::string data = "# choice, core-seconds over the base's, work over the base's, change of the error in percent points\n";
    int rows = 0;
    double greatest = 1, largest = 0.1;
    for (const auto& p : study.points) {
        if (!p.asked.choice || !p.finished() || &p == base) continue;
        const double change = 100 * (p.error[std::size_t(m)] - base->error[std::size_t(m)]);
        const double time = p.core_seconds / base->core_seconds;
        std::string name = io::comment_text(p.asked.curve); // in a table of gnuplot, where a double quote ends it
        std::replace(name.begin(), name.end(), '"', '\'');
        data += fmt::format("\"{}\" {:.5g} {:.5g} {:.5g}\n", name, time, p.work / base->work, std::isfinite(change) ? change : 0.0);
        greatest = std::max(greatest, time), largest = std::max(largest, std::fabs(std::isfinite(change) ? change : 0.0)), ++rows;
    }
    if (!rows) return {};
    io::write_atomically(folder / "choices.dat", data);
    std::string c = fmt::format(
        "set multiplot layout 1,2 title {}\nset style fill solid 0.85 noborder\nset yrange [{}:-0.7]\nunset key\nset grid noytics\n"
        "set ytics scale 0\nset lmargin at screen 0.30; set rmargin at screen 0.61\nset xlabel 'time over that of the base'\nset xrange "
        "[0:{:.3g}]\n"
        "set arrow 1 from 1,-0.7 to 1,{} nohead lc rgb '#404040'\n"
        "plot 'choices.dat' u ($2/2):0:($2/2):(0.3):ytic(1) w boxxy lc rgb '#4477aa', '' u 2:0:(sprintf('  %.2f', $2)) w labels left\n",
        io::gnuplot_string(study.sweep.title + ": what each choice costs, against \"base\""), rows - 0.3, 1.25 * greatest, rows - 0.3);
    c += fmt::format("unset arrow 1\nset lmargin at screen 0.67; set rmargin at screen 0.97\nset xlabel 'change of the error of {} "
                     "(percent points)'\nset xrange [{:.3g}:{:.3g}]\n"
                     "set ytics format ''\nset arrow 2 from 0,-0.7 to 0,{} nohead lc rgb '#404040'\n"
                     "plot 'choices.dat' u ($4/2):0:(abs($4)/2):(0.3) w boxxy lc rgb '#ee6677', '' u ($4>0?$4:0):0:(sprintf('  %+.2f', "
                     "$4)) w labels left\nunset multiplot\n",
                     io::measure_names()[std::size_t(m)], -1.6 * largest, 1.9 * largest, rows - 0.3);
    return both("choices", 1100, 120 + 34 * rows, c);
}

} // namespace

std::string draw(const Study& study, const io::Path& folder)
{
    std::error_code error;
    std::filesystem::create_directories(folder, error);
    std::string script = "# gnuplot figures.gp, in this directory\n";
    std::vector<std::string> names;
    for (const auto m : study.sweep.measures)
        if (const auto s = cost_figure(study, m, folder); !s.empty()) script += s, names.push_back("error_" + file_of(m));
    if (const auto s = choice_figure(study, folder); !s.empty()) script += s, names.push_back("choices");
    if (names.empty()) return "no figure: no point has an error and a cost";
    io::write_atomically(folder / "figures.gp", script);
    const auto code = run_program({"gnuplot", "figures.gp"}, folder, "gnuplot.log");
    if (!code)
        return fmt::format(
            "gnuplot is not installed: data and figures.gp are in {}; install gnuplot-nox and run `gnuplot figures.gp` there",
            folder.string());
    if (*code != 0) return fmt::format("gnuplot failed: see {}", (folder / "gnuplot.log").string());
    return fmt::format("figures in {}: {} (png, svg)", folder.string(), fmt::join(names, ", "));
}

} // namespace kuzure::study
