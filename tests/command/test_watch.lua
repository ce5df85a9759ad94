-- rapid run --watch: when it runs again, its messages, and how it ends.
local command = require "testing.command"

local scene = [[
local rapid = require "rapid"
local height = require "height"
return rapid.create { points = rapid.points.from { P = {{0, height, 0}} } } :mine {} :solve {}
]]
local node = [[
return require "rapid".node { name = "mine", doc = "A test.", points = function(p) p.v = vec3(0, 0, 0) end }
]]

-- Runs a watch together with steps: shell commands, each run after the log contains its text the given number of times.
-- Ends the watch by a signal.
local function watch(steps, options)
  options = options or {}
  local folder = command.folder()
  folder:write("scene.lua", scene)
  folder:write("height.lua", "return 1")
  folder:write("mine.lua", node)
  -- Waits for the log, because grep prints no number for a missing file.
  local script = [[
: >log
await() {  # TEXT TIMES: in the log, within 20 s
  for _ in $(seq 400); do
    [ "$(grep -c -- "$1" log)" -lt "$2" ] || return 0
    sleep 0.05
  done
  echo "never: $1 $2" >>log
}
(
]]
  for _, step in ipairs(steps) do
    script = script .. ("await '%s' %d\n%s\n"):format(step[1], step[2], step[3])
  end
  script = script .. ("kill -%s $(cat pid)\n) &\n"):format(options.signal or "INT") ..
    "timeout 60 sh -c 'echo $$ >pid; exec \"$0\" run scene.lua --watch -f 1-2 -o all.#.csv' " ..
    "\"$RAPID\" >>log 2>&1\necho status $? >>log\nwait\n"
  command.shell(script, { cwd = folder.path })
  return folder:read "log", folder
end

describe("rapid run --watch", function()
  it("runs again when the graph, a module or a node in Lua changes, and says which", function()
    local log, folder = watch {
      { "^watching", 1, "echo 'return 2' >height.lua" },
      { "^watching", 2, "echo '-- more' >>mine.lua" },
      { "^watching", 3, "sed 's/{0, height, 0}/{7, height, 0}/' scene.lua >new && mv new scene.lua" },
      { "^watching", 4, "echo unread >other.lua; sleep 0.3" },
    }
    for _, name in ipairs { "height.lua", "mine.lua", "scene.lua" } do
      assert.truthy(log:find("\n" .. name .. " changed; running again\n", 1, true), log)
    end
    assert.equal(3, select(2, log:gsub("running again", "")))
    assert.equal("id,Px,Py,Pz,vx,vy,vz\n0,7,2,0,0,0,0\n", folder:read "all.0002.csv")
    assert.truthy(log:find("status 130\n", 1, true), log)
  end)

  it("takes several changes at once for one", function()
    local log = watch { { "^watching", 1, "echo '--' >>mine.lua; echo 'return 3' >height.lua; sleep 0.02; " ..
      "echo '--' >>scene.lua" }, { "^watching", 2, "" } }
    assert.truthy(log:find("height.lua, mine.lua, scene.lua changed; running again\n", 1, true), log)
    assert.equal(1, select(2, log:gsub("running again", "")))
  end)

  it("outlives errors of the graph, and files that come later", function()
    local log, folder = watch {
      { "^watching", 1, "echo 'return nil + 1' >height.lua" },
      { "^watching", 2, "rm mine.lua; echo 'return 4' >height.lua" },
      { "^watching", 3, "cp scene.lua keep; rm scene.lua" },
      { "^watching", 4, ("printf '%%s' '%s' >mine.lua; mv keep scene.lua"):format(node) },
      { "^watching", 5, "" },
    }
    assert.truthy(log:find("height.lua:1: attempt to perform arithmetic on a nil value", 1, true), log)
    assert.truthy(log:find('unknown node "mine"', 1, true), log)
    assert.truthy(log:find("scene.lua: No such file or directory", 1, true), log)
    assert.equal("id,Px,Py,Pz,vx,vy,vz\n0,0,4,0,0,0,0\n", folder:read "all.0002.csv")
  end)

  it("stops a run that is not done, and starts again", function()
    local log = watch {
      { "^watching", 1, "echo 'local x = 0 while true do x = x + 1 end' >height.lua" },
      { "running again", 1, "sleep 0.3; echo 'return 5' >height.lua" },
      { "^watching", 2, "" },
    }
    assert.equal(2, select(2, log:gsub("height.lua changed; running again", "")), log)
    assert.truthy(log:find("status 130\n", 1, true), log)
  end)

  it("ends with 143 after SIGTERM", function()
    assert.truthy(watch({ { "^watching", 1, "" } }, { signal = "TERM" }):find("status 143\n", 1, true))
  end)
end)
