#pragma once
// What a run says while it goes: one line that renews itself on a terminal, plain lines ever further apart in a log.
#include "solver/app/run/fronts.hpp"
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace kuzure {

/// Where a run stands. What comes from the last row of the history is absent before there is one.
struct Status {
    double time = 0; // s
    std::int64_t step = 0;
    double dt = 0, max_speed = 0;   // s, m/s
    std::optional<double> residual; // 1
    std::optional<Fronts> fronts;
    int dimensions = 3, ranks = 1;
    double imbalance = 1; // busiest rank over the mean
};

/// How progress is shown: a bar that renews itself, lines for a log, or not at all. Auto: a bar on a terminal of one's own, lines
/// elsewhere: in a file, and under mpirun, which gives its ranks a terminal without a screen and prints what comes out of it line by line.
enum class Progress { Auto, Bar, Plain, None };
/// "auto", "bar", "plain", "none", in this order.
const std::vector<std::string>& progress_names();

class StatusLine {
public:
    /// end, begin: simulated times, s; step: that of begin.
    StatusLine(bool prints, Progress, double end, double begin, std::int64_t step);
    /// True if something should be shown now. `final`: whatever the clock says.
    bool due(bool final) const;
    void show(const Status&, bool final);
    /// Takes the bar away for a line of other words; the next show() brings it back.
    void make_room();
    StatusLine(const StatusLine&) = delete;
    ~StatusLine();

    /// The words alone; rate in steps/s, left in s of wall time (negative: unknown).
    static std::string text(const Status&, double end, double rate, double left);
    /// As many of the words as the columns hold, none of them in part.
    static std::string shortened(const std::string& text, std::size_t columns);

private:
    bool prints_, bar_, standing_ = false; // standing: the cursor is behind a bar
    double end_, start_, last_;            // s; wall clock
    double time_;                          // s, simulated, when last shown
    std::int64_t step_;
    double rate_ = 0, pace_ = 0; // steps/s, simulated s a wall s: of late
};

} // namespace kuzure
