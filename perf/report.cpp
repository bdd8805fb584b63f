#include "perf/report.hpp"

#include <fmt/format.h>
#include <iterator>
#include <nlohmann/json.hpp>
#include <vector>

namespace kuzure {
namespace {

nlohmann::ordered_json as_json(const PhaseRow& row)
{
    nlohmann::ordered_json j{
        {"seconds", {{"min", row.min}, {"mean", row.mean}, {"max", row.max}}}, {"calls", row.calls}, {"share", row.share}};
    if (row.flops > 0) {
        j["gflop_per_second"] = row.gflops();
        j["flop_per_byte"] = row.intensity();
    }
    if (row.bytes > 0) j["gbyte_per_second"] = row.gbytes();
    return j;
}

/// A count in groups of three digits.
std::string grouped(std::int64_t n)
{
    std::string s = std::to_string(n);
    for (auto at = std::ptrdiff_t(s.size()) - 3; at > (n < 0); at -= 3) s.insert(std::size_t(at), 1, ' ');
    return s;
}

} // namespace

PhaseReport phase_report(const Timers& timers, const WorkDone& mine, int threads, const Team& team)
{
    // Rows 0 .. n-1 are the phases, then the pair loop, then the whole.
    constexpr int n = n_phases + 2, pair_loop = n_phases, whole = n_phases + 1;
    std::vector<double> low(n), sums(3 * n);
    std::vector<std::int64_t> calls(n);
    const auto put = [&](int row, Phase phase) {
        low[row] += timers.seconds(phase);
        sums[n + row] += timers.flops(phase);
        sums[2 * n + row] += timers.bytes(phase);
        calls[row] += timers.calls(phase);
    };
    for (int p = 0; p < n_phases; ++p) {
        put(p, Phase(p));
        put(whole, Phase(p));
    }
    put(pair_loop, Phase::Interior);
    put(pair_loop, Phase::Rim);
    calls[whole] = timers.calls(Phase::Total);
    calls[pair_loop] = timers.calls(Phase::Interior);
    std::copy(low.begin(), low.end(), sums.begin());
    std::vector<double> high = low;
    team.min(std::span(low));
    team.max(std::span(high));
    team.sum(std::span(sums));
    team.max(std::span(calls));

    PhaseReport report;
    report.ranks = team.size();
    report.threads = threads;
    report.work = {.steps = team.max(mine.steps),
                   .particle_steps = team.sum(mine.particle_steps),
                   .pairs = team.sum(mine.pairs),
                   .asleep = team.sum(mine.asleep),
                   .halo_bytes = team.sum(mine.halo_bytes),
                   .messages = team.sum(mine.messages)};
    // Every rank's numbers in its own slot of a sum: integers add up the same way everywhere.
    report.first_step.resize(std::size_t(team.size()));
    report.first_step[std::size_t(team.rank())] = mine.first_step;
    static_assert(sizeof(RankStep) == 5 * sizeof(std::int64_t));
    team.sum(std::span(&report.first_step.front().soil, 5 * report.first_step.size()));
    const auto row = [&](int k) {
        return PhaseRow{.min = low[k],
                        .mean = sums[k] / team.size(),
                        .max = high[k],
                        .calls = calls[k],
                        .share = sums[whole] > 0 ? sums[k] / sums[whole] : 0,
                        .flops = sums[n + k],
                        .bytes = sums[2 * n + k]};
    };
    for (int p = 0; p < n_phases; ++p) report.rows[p] = row(p);
    report.pair_loop = row(pair_loop);
    report.total = row(whole);
    // Sums of doubles come in no fixed order: the root's go to all.
    team.broadcast(std::as_writable_bytes(std::span(&report.total, 1)));
    team.broadcast(std::as_writable_bytes(std::span(&report.pair_loop, 1)));
    team.broadcast(std::as_writable_bytes(std::span(report.rows)));
    return report;
}

std::string PhaseReport::json() const
{
    nlohmann::ordered_json j{{"ranks", ranks},
                             {"threads", threads},
                             {"steps", work.steps},
                             {"particle_steps", work.particle_steps},
                             {"pairs", work.pairs},
                             {"particle_steps_asleep", work.asleep},
                             {"halo_bytes", work.halo_bytes},
                             {"messages", work.messages},
                             {"seconds", total.max},
                             {"gflop_per_second", pair_loop.gflops()},
                             {"flop_per_byte", pair_loop.intensity()},
                             {"total", as_json(total)},
                             {"pair_loop", as_json(pair_loop)},
                             {"phases", nlohmann::ordered_json::object()}};
    for (int p = 0; p < n_phases; ++p)
        if (rows[p].calls > 0) j["phases"][std::string(name(Phase(p)))] = as_json(rows[p]);
    for (const RankStep& r : first_step)
        j["first_step"].push_back(
            {{"soil", r.soil}, {"pairs", r.pairs}, {"ghosts", r.ghosts}, {"halo_bytes", r.halo_bytes}, {"messages", r.messages}});
    if (machine) j["machine"] = nlohmann::ordered_json::parse(to_json(*machine));
    return j.dump(2) + '\n';
}

std::string PhaseReport::text() const
{
    std::string out;
    const auto line = [&]<class... A>(fmt::format_string<A...> f, A&&... a) {
        fmt::format_to(std::back_inserter(out), f, std::forward<A>(a)...);
        out += '\n';
    };
    line("Wall time by phase: {} rank{} of {} thread{}, {} steps", ranks, ranks == 1 ? "" : "s", threads, threads == 1 ? "" : "s",
         grouped(work.steps));
    line("");
    line("{:<16}{:>11}{:>11}{:>11}{:>8}{:>12}{:>10}{:>11}", "", "min s", "mean s", "max s", "share", "calls", "Gflop/s", "flop/byte");
    const auto print = [&](std::string_view title, const PhaseRow& row) {
        const bool counted = row.flops > 0;
        line("{:<16}{:>11.3f}{:>11.3f}{:>11.3f}{:>7.1f}%{:>12}{:>10}{:>11}", title, row.min, row.mean, row.max, 100 * row.share,
             grouped(row.calls), counted ? fmt::format("{:.2f}", row.gflops()) : "",
             counted && row.bytes > 0 ? fmt::format("{:.2f}", row.intensity()) : "");
    };
    for (int p = 0; p < n_phases; ++p)
        if (rows[p].calls > 0) print(name(Phase(p)), rows[p]);
    line("{}", std::string(90, '-'));
    print("total", total);

    const auto each = [](double seconds, std::int64_t count) { return count > 0 ? seconds / double(count) : 0; };
    line("");
    line("pairs               {} directed, {:.1f} per soil particle and step", grouped(work.pairs),
         each(double(work.pairs), work.particle_steps));
    if (work.asleep > 0)
        line("asleep              {:.1f} % of the soil particles' steps", 100 * each(double(work.asleep), work.particle_steps));
    if (work.messages > 0)
        line("halo                {:.1f} kB in {:.1f} messages a rank and step", 1e-3 * each(double(work.halo_bytes) / ranks, work.steps),
             each(double(work.messages) / ranks, work.steps));
    line("time                {:.3f} ms a step, {:.1f} ns a soil particle and step", 1e3 * each(total.max, work.steps),
         1e9 * each(total.max, work.particle_steps));
    if (pair_loop.max > 0) {
        line("pair loop           {:.2f} ns a pair, {:.2f} Gflop/s, {:.2f} flop/byte, slowest rank {:.2f} of the mean",
             1e9 * each(pair_loop.max, work.pairs), pair_loop.gflops(), pair_loop.intensity(),
             pair_loop.mean > 0 ? pair_loop.max / pair_loop.mean : 0);
    }
    if (machine) {
        line("this machine        {}, {}", machine->cpu, machine->instruction_set);
        line("  multiply-add      {:.0f} Gflop/s double, {:.0f} single (one thread {:.0f}, {:.0f})", machine->gflops_double_all,
             machine->gflops_float_all, machine->gflops_double_one, machine->gflops_float_one);
        line("  memory            {:.0f} GB/s (one thread {:.0f})", machine->gbytes_all, machine->gbytes_one);
    }
    return out;
}

} // namespace kuzure
