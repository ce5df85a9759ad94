// Advice for meshes with boundary edges, which enclose no volume.
#pragma once

namespace rapid {

// Part of error messages.
inline constexpr char open_mesh_remedy[] =
    "close it: a ground, by a copy of its outer edge lower down, faces between the two, and a bottom";

}  // namespace rapid
