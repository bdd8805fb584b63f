#pragma once
// What a run says: lines and a status line on standard output, warnings on standard error, which its summary repeats.
#include "solver/app/run/status.hpp"
#include <optional>
#include <string>
#include <vector>

namespace kuzure {

class Messages {
public:
    /// root: this is rank 0, the only one that says anything. quiet: nothing on standard output. twin: its warnings are those of the run it
    /// belongs to and are kept only.
    Messages(bool root, bool quiet, bool twin) : prints_(root && !quiet), warns_(root && !twin), ends_(root && quiet && !twin) {}
    /// A line on standard output.
    void say(const std::string&);
    /// A warning, kept for the summary.
    void warn(const std::string&);
    /// A line even where the run is quiet: then on standard error.
    void say_aloud(const std::string&);
    bool prints() const { return prints_; }
    const std::vector<std::string>& warnings() const { return warnings_; }

    /// Begins the status line; arguments as StatusLine's.
    void begin_status(Progress, double end, double begin, std::int64_t step);
    /// True if show() should be called now.
    bool due(bool final) const { return status_ && status_->due(final); }
    void show(const Status& s, bool final) { status_->show(s, final); }

private:
    bool prints_, warns_, ends_;
    std::optional<StatusLine> status_;
    std::vector<std::string> warnings_;
};

} // namespace kuzure
