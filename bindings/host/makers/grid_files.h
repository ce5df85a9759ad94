// Files of a sequence of grids, as makers take them.
#pragma once

#include <string>

#include "bindings/host/maker.h"
#include "bindings/host/makers/sequence_options.h"
#include "runtime/files/skipped_contents.h"
#include "runtime/shapes/level_set/grid_sequence.h"

namespace rapid {

// Parameters of a maker that can read a sequence of .vdb files; T derives from it.
struct GridFiles : SequenceOptions {
    std::string path, grid;

    template <class T>
    static Maker declare(MakerDeclaration<T>& declaration, const std::string& grid_doc)
    {
        declaration
            .param(
                static_cast<std::string T::*>(&T::path), "path", Value(), any_number(), "",
                "path, relative to the graph file; with #### or $F4 a sequence with a file for each frame or for some")
            .required();
        declaration.param(static_cast<std::string T::*>(&T::grid), "grid", Value(), any_number(), "", grid_doc);
        return SequenceOptions::declare(declaration);
    }

    bool is_sequence(const MakeContext& context) const;
    // Returns the files of a sequence. Throws Error if there are none.
    SequenceFiles files(MakeContext& context) const;

    // Reads a single file and adds the reader's notes to the warnings.
    template <class Read>
    auto read_one(MakeContext& context, const Read& read) const
    {
        const SkippedContents notes;
        auto object = read(context.resolve(path), grid);
        for (const std::string& note : notes.list()) context.warnings.push_back(fmt::format("\"{}\": {}", path, note));
        return object;
    }

    // Returns the grid, or the sequence of grids, that read(path, grid) reads. The first file is read at once to report
    // its errors.
    template <class G, class Read>
    ObjectPtr make_with(MakeContext& context, const Read& read) const
    {
        check(path, is_sequence(context));
        if (!is_sequence(context)) return read_one(context, read);
        SequenceFiles sequence = files(context);
        const std::int64_t first = sequence.files.begin()->first + sequence.order.offset;
        const auto read_file = [&read, name = grid](const std::filesystem::path& file) { return read(file, name); };
        auto made = std::make_shared<GridSequence<G>>(std::move(sequence), read_file);
        made->over(first);
        return made;
    }
};

}  // namespace rapid
