#pragma once
// Which factors are tried: whole numbers of brackets above the least, halving what is left, so that the answer does not depend on how
// many trials run at a time.
#include "solver/app/safety/trial.hpp"
#include <map>
#include <optional>
#include <set>

namespace kuzure::safety {

class Search {
public:
    /// Factors from `from`, which holds, by `width` up to `to`. Throws BadInput where there are too few or too many.
    Search(double from, double to, double width);
    double factor(int step) const;
    /// What a step between 0 and the last turned out to be.
    void tell(int step, Outcome);
    /// The next step worth a trial while those run, the most useful first; nothing where none is.
    std::optional<int> next(const std::set<int>& running) const;
    /// Whether the outcome of a step is known already from others.
    bool idle(int step) const { return step <= holds_ || step >= fails_; }
    bool done() const { return fails_ - holds_ == 1; }
    int holds() const { return holds_; }
    /// One beyond the last step: nothing has failed.
    int fails() const { return fails_; }
    int steps() const { return steps_; }

private:
    double from_, to_, width_;
    int steps_, holds_ = 0, fails_;
};

} // namespace kuzure::safety
