// Advice for meshes with boundary edges, which enclose no volume.
#pragma once

namespace rapid {

// Part of error messages.
inline constexpr char open_mesh_remedy[] =
    "close it: for a ground, add a copy of its outer edge lower down, faces between the two, and a bottom";

}  // namespace rapid
