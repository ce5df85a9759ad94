-- Programs that violate guarded memory (guard.h) are ended.
local command = require "testing.command"
local library = require "tests.faults.library"

local head = [[
local ffi = require "ffi"
ffi.cdef "void* malloc(size_t); void* calloc(size_t, size_t); void* realloc(void*, size_t); void free(void*);"
local function block(bytes) return ffi.cast("volatile char*", ffi.C.malloc(bytes)) end
local function free(p) ffi.C.free(ffi.cast("void*", p)) end
describe("memory", function() it("is used", function()
]]

local function run(text)
  local folder = command.folder()
  folder:write("test.lua", head .. text .. "\nend) end)\n")
  return command.rapid("test test.lua", { cwd = folder.path, environment = {
    LD_PRELOAD = library, RAPID_STRESS = "guard" } })
end

describe("guarded memory", function()
  it("keeps its contents, also when it is reallocated", function()
    local result = run [[
for bytes = 0, 5000, 7 do
  local p = block(bytes)
  for i = 0, bytes - 1 do p[i] = i % 100 end
  p = ffi.cast("volatile char*", ffi.C.realloc(ffi.cast("void*", p), bytes + 4000))
  for i = 0, bytes - 1 do assert(p[i] == i % 100) end
  free(p)
  local zeros = ffi.cast("char*", ffi.C.calloc(bytes, 3))
  for i = 0, 3 * bytes - 1 do assert(zeros[i] == 0) end
  free(zeros)
end]]
    assert.equal(0, result.status, result.stdout .. result.stderr)
  end)

  it("ends what reads or writes beyond it, or after it was freed, or frees twice", function()
    for text, said in pairs {
      ["local p = block(64) local x = p[64]"] = "signal",
      ["local p = block(64) p[64] = 1"] = "signal",
      ["local p = block(4096) p[4096] = 1"] = "signal",
      ["local p = block(64) free(p) local x = p[0]"] = "signal",
      ["local p = block(64) free(p) free(p)"] = "signal",
      ["local p = block(60) p[60] = 1 free(p)"] = "behind its end",
    } do
      local result = run(text)
      assert.equal(1, result.status, text)
      local all = result.stdout .. result.stderr
      assert.truthy(all:find(said, 1, true), text .. ": " .. all)
    end
  end)
end)
