// A process that reads files for one that may start no others.
//
// It is forked before that one gives up its rights, is confined, too, and waits for requests: the name of a reader, of
// a file and of a part of it. For each it forks a copy, which reads the file (read_apart.h), and sends back what that
// has read, or why it has not. It ends with the process that it serves.
#pragma once

#include <functional>
#include <string>

#include "runtime/files/message.h"

namespace rapid {

struct ReadRequest {
    std::string reader, path, what;
};

// Readers are known by name, since requests come from another process.
using NamedReader = std::function<void(const ReadRequest& request, MessageWriter& message)>;
void define_reader(const std::string& name, NamedReader reader);

// Starts the process, which calls `confine` before it serves; once, and while this process has one thread. Error: it
// can't be started, or `confine` threw.
void start_reader_process(const std::function<void()>& confine);

// By the reader process, where there is one; else in a copy of this process. From any thread. Error: the reader's, or
// that it ended.
void read_by_name(const ReadRequest& request, const std::function<void(MessageReader&)>& receive);

}  // namespace rapid
