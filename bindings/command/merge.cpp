// rapid merge: merges the parts of a run.
#include <fmt/format.h>

#include <filesystem>

#include "bindings/command_line/command.h"
#include "bindings/command_line/untrusted.h"
#include "include/rapid/merge.h"
#include "runtime/base/threads.h"

namespace rapid {
namespace {

class Merge : public Command, public Confined {
public:
    std::string name() const override { return "merge"; }
    std::string doc() const override
    {
        return "merges the parts of a run; the result is bit-identical to the whole run";
    }

    void declare(Options& options) override
    {
        options.add_option("-o,--output", output_, "the merged files: #### is the frame number")
            .type_name("WHOLE")
            .required();
        options
            .add_option("PART", parts_, "the files of the parts, as -o of run named them; {part} stands for all parts")
            .type_name("")
            .required();
        options.add_flag("--quiet", quiet_, "prints only errors");
        untrusted_.declare(options, "file");
    }

    void confine(const CommonOptions& common) override
    {
        untrusted_.confine(
            [&] {
                SandboxAccess access;
                for (const std::string& part : parts_) access.readable.push_back(folder_of(part));
                access.writable.push_back(folder_of(output_));
                std::filesystem::create_directories(access.writable.back());
                return access;
            },
            common);
    }

    int run(const CommonOptions& common) override
    {
        Threads threads(common.threads);
        return threads.run([&] {
            const Result<MergedFiles> merged = merge_files(parts_, output_);
            if (!merged && merged.error().kind == SceneError::WrongCall) throw SceneException(merged.error());
            if (!merged) {
                print_error(merged.error(), common.verbose);
                return status_failed;
            }
            if (!quiet_)
                print(fmt::format("merged {} frames of {} parts, {} points: {}\n", merged->frames, merged->parts,
                                  merged->points, output_));
            return status_done;
        });
    }

private:
    std::string output_;
    std::vector<std::string> parts_;
    bool quiet_ = false;
    UntrustedOptions untrusted_;
};
RAPID_COMMAND(Merge);

}  // namespace
}  // namespace rapid
