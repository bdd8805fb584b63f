#pragma once
// What the system may tell a program, from the first line of main() on.

namespace kuzure {

/// SIGTERM, SIGINT, SIGHUP and SIGUSR1 ask to stop (the run loop looks); a second SIGINT ends the program at once. SIGPIPE and SIGXFSZ are
/// ignored: the write that caused them fails and says so. Standard streams that are closed are opened to nowhere, so that no result file
/// gets their numbers.
void listen_to_signals();

/// For commands that leave nothing behind: what asks to stop ends the program, also what has come already.
void stop_listening();

/// True once a signal asked to stop.
bool asked_to_stop();

} // namespace kuzure
