#include "runtime/files/whole_file.h"

#include "runtime/files/output_file.h"

namespace rapid {

void write_whole(const std::filesystem::path& path, std::string_view bytes)
{
    try {
        OutputFile file(path);
        file.append(bytes.data(), bytes.size());
        file.finish();
    } catch (Error& error) {
        throw error.at({path.string(), 0});
    }
}

}  // namespace rapid
