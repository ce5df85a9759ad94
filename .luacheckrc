-- Lua as Rapid runs it: LuaJIT; in graphs and nodes the names that need no require; in tests busted and our assertions.
std = "luajit"
max_line_length = 120
cache = false
color = false
exclude_files = { "lua/annotations.lua", "lua/rapid.d.lua" } -- declarations without bodies

local graph_code = { read_globals = { "vec3", "quat" } }
files["graphs"] = graph_code
files["lua/nodes"] = graph_code

-- Takes functions away before any graph code runs.
files["lua/host.lua"] = { globals = { string = { fields = { "dump" } } } }

files["tests"] = {
  std = "luajit+busted",
  read_globals = { "rapid", "vec3", "quat", assert = { fields = { "conserved", "near", "points", "same_points" } } },
}

-- What `rapid new` writes.
files["lua/new"] = graph_code
files["lua/new/test.lua"] = files["tests"]
