// The system calls that a sandboxed process may make: a list of those that Rapid needs (seccomp). All others fail with
// EPERM. A call by the numbers of another architecture (32 bits, x32) ends the process with SIGSYS.
#pragma once

namespace rapid {

enum class Processes {
    None,    // threads alone
    Copies,  // it may fork, and wait for the copies, which have the same filter; it starts no other program
};

enum class Connections {
    None,
    Accepted,  // those that come in by a socket that listens already; the process makes no socket of its own
};

// Returns a status of seccomp's: 0, or a negative errno. Holds all threads, and those that they start.
int load_system_call_filter(Processes processes, Connections connections = Connections::None);

}  // namespace rapid
