#include "solver/app/run/messages.hpp"
#include "solver/app/cli/command.hpp"
#include <cstdio>

namespace kuzure {

void Messages::say(const std::string& text)
{
    if (status_) status_->make_room();
    // Not by fmt, which throws: a run goes on when its messages cannot be written.
    if (prints_) std::fputs((text + "\n").c_str(), stdout), std::fflush(stdout);
}

void Messages::warn(const std::string& text)
{
    warnings_.push_back(text);
    if (warns_) complain("warning: " + text);
}

void Messages::say_aloud(const std::string& text)
{
    if (ends_) complain(text);
    say(text);
}

void Messages::begin_status(Progress progress, double end, double begin, std::int64_t step)
{
    status_.emplace(prints_, progress, end, begin, step);
}

} // namespace kuzure
