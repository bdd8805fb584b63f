#pragma once
// When cutting anew pays. Decided from numbers that all ranks share; the decision never changes a bit of the result.
#include "solver/core/team.hpp"

namespace kuzure {

/// Largest over mean of a figure of each rank (seconds, pair work); 1 where all are zero. Collective.
double imbalance(const Team&, double mine);

/// Stop at rise (Nicol and Saltz 1988; OpenFPM): cut anew when the mean cost per step since the last cut,
/// W(n) = (sum of idle time + cost of cutting)/n, starts to rise. While the idle time per step grows evenly W
/// is least just when the idle time has added up to the cost of a cut; that form is used here, for it also
/// answers an idle time that stays the same, where W falls for ever. Idle time that a fresh cut did not
/// remove does not count, so the rule falls silent where cutting does not help; what does count is summed
/// with its sign (never below zero), so that noise cancels.
class Rebalance {
public:
    /// `promised`: the imbalance that the first cut expects (CutReport::imbalance); `cut_seconds`: what it cost.
    explicit Rebalance(double promised = 1, double cut_seconds = 0);

    /// After every so many steps: the seconds this rank worked since the last call, waiting excluded. True,
    /// on every rank, if a cut pays now. Collective.
    bool due(const Team&, double busy_seconds);
    /// After a new cut: the seconds it cost, migration and list building included (the longest rank counts). Collective.
    void cut(const Team&, double seconds);

    /// Of the last call of due().
    double imbalance() const { return imbalance_; }
    /// Avoidable idle seconds added up since the last cut, and what must be exceeded.
    double idle_seconds() const { return idle_; }
    double cut_seconds() const { return cost_; }

private:
    static constexpr double noticeable = 0.02; // idle share below which imbalance is noise
    static constexpr int settling = 3;         // calls after a new cut that show what it achieved; the first is cold
    double floor_;                             // idle share that the present cut started from
    double cost_;                              // s
    double idle_ = 0;                          // s
    double imbalance_ = 1, smooth_ = 1;
    int calls_ = 0;         // since the last cut
    bool measured_ = false; // the present cut was made by cut(): its first calls set floor_
};

} // namespace kuzure
