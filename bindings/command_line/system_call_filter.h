// The allowlist of system calls for a sandboxed process (seccomp). All others fail with EPERM. A call by the numbers of
// another architecture (32 bits, x32) ends the process with SIGSYS.
#pragma once

namespace rapid {

enum class Processes {
    None,    // threads only
    Copies,  // may fork, and wait for the copies, which have the same filter; starts no other program
};

enum class Connections {
    None,
    Accepted,  // accepts on a socket that already listens; cannot create sockets
};

// Installs the filter on all threads and their children. Returns a seccomp status: 0, or a negative errno.
int load_system_call_filter(Processes processes, Connections connections = Connections::None);

}  // namespace rapid
