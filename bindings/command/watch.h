// rapid run --watch: runs the graph again whenever a file changes that the last run read, or would have read.
//
// Each run is a process of its own, so that a scene that crashes or never ends does not end the watch. The run
// tells which files it reads; their folders are watched (inotify), so that an editor that saves by renaming is seen,
// and a file that did not exist yet.
#pragma once

#include <filesystem>
#include <map>
#include <set>
#include <string>

namespace rapid {

class Watch {
public:
    // The hidden option of a run that is watched; such a run calls report() with each file.
    static constexpr const char* report_option = "--report-files";
    static void report(const std::filesystem::path& file);

    Watch(std::filesystem::path graph, bool quiet);
    ~Watch();
    Watch(const Watch&) = delete;
    Watch& operator=(const Watch&) = delete;

    // Runs this process's own command line until it is ended by a signal; 128 + the signal.
    int run();

private:
    void start();
    void stop();
    void add(const std::filesystem::path& file);
    void read_reports();
    void read_events();
    void read_signals();
    void collect(bool& running);
    void say(const std::string& text) const;

    const std::filesystem::path graph_;
    const bool quiet_;
    const int notify_, signals_;  // descriptors: inotify, signalfd
    int reports_ = -1;            // the pipe from the run
    std::string partial_report_;  // of it, the part that is not yet a whole line
    int child_ = 0;               // 0: no run
    int ended_by_ = 0;            // a signal that ends the watch
    std::filesystem::file_time_type started_;

    std::map<int, std::filesystem::path> folders_;  // by inotify's number
    std::set<std::filesystem::path> files_;         // absolute
    std::set<std::filesystem::path> changed_;       // since the run began
};

}  // namespace rapid
