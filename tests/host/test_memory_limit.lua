-- --script-memory, reached at any moment: in the interpreter, and in code that LuaJIT has compiled and may have linked
-- to other code since.
--
--   RAPID_LIMITS=100 build/test/bin/rapid test tests/host/test_memory_limit.lua   runs per place and program (1)
local amount = require "tests.amount"
local lehmer = require "tests.lehmer".new(5)
local places = require "tests.script_places"
local scene = require "testing.scene"

-- Programs that allocate without end.
local programs = {
  tables = "local t = {} for i = 1, 1e9 do t[i] = { i } end",
  numbers = "local t = {} for i = 1, 1e9 do t[i] = i end",
  strings = "local t = {} for i = 1, 1e9 do t[#t + 1] = ('x'):rep(i % 300) .. i end",
  vectors = "local t = {} for i = 1, 1e9 do t[i] = vec3(i, 0, 0) end",
  trees = "local function tree(n) if n < 1 then return {} end return { tree(n - 1), tree(n - 1), n } end " ..
    "local t = {} for i = 1, 1e9 do t[i] = tree(i % 6) end",
  branches = "local t = {} for i = 1, 1e9 do if i % 3 == 0 then t[i] = { i } elseif i % 7 == 0 then " ..
    "t[i] = 'n' .. i else for k = 1, i % 4 do t['k' .. i .. k] = { t[i - k] } end end end",
  coroutines = "local t = {} for i = 1, 1e9 do coroutine.wrap(function() for k = 1, 200 do t[#t + 1] = { k } end " ..
    "end)() end",
  protected = "local t = {} for i = 1, 1e9 do pcall(function() for k = 1, 200 do t[#t + 1] = { k } end end) end",
  sorts = "local t = {} for i = 1, 1e9 do table.sort({ 3, 1, 2 }, function(a, b) t[#t + 1] = { a, b } " ..
    "return a < b end) end",
}

describe("--script-memory", function()
  it("is an error with its place, in every place and program, at any limit", function()
    for _ = 1, amount.of("RAPID_LIMITS", 1) do
      for where, place in pairs(places) do
        for name, program in pairs(programs) do
          local limit = 9000000 + lehmer.below(24000000)
          local result = scene.command("run", place:format(program),
            ("-f 1-2 --quiet --script-memory %d"):format(limit))
          local case = ("%s in %s with %d: %s"):format(name, where, limit, result.stderr)
          assert.truthy(result.status == 1 or result.status == 2, case)
          -- If a body has filled the memory, the line is unknown.
          assert.truthy(result.stderr:find(where == "body" and "^scene.lua:" or "^scene.lua:%d+: "), case)
          local message = ("the script needs more than %d MiB of Lua memory; --script-memory sets the limit")
            :format(math.floor(limit / 2 ^ 20))
          assert.truthy(result.stderr:find(message, 1, true), case)
        end
      end
    end
  end)
end)
