-- Stiff nodes, reported by `rapid check` and in the --stats of a run with figures computed from the points.
local command = require "testing.command"
local json = require "dkjson"

local head = [[
local rapid = require "rapid"
local one = rapid.points.from { P = {{1, 0, 0}}, v = {{0, 0, 2}} }
]]
local omega = 1.9 * 24

-- An orbit with omega rad/s, driven by an action, so that it is not solved in closed form.
local sun = head .. [[
return rapid.create { fps = 24, points = one }
  :action("sun", function(p) p.force = p.force - 45.6 ^ 2 * p.P end) :solve { %s }
]]

local function rapid(arguments, text)
  local folder = command.folder()
  folder:write("scene.lua", text)
  return command.rapid(arguments, { cwd = folder.path }), folder
end

-- Returns the lines about stiff nodes; those of a run are in its --stats.
local function advice(arguments, text)
  local runs = arguments:find "^run"
  local result, folder = rapid(runs and arguments .. " --stats stats.json" or arguments, text)
  assert.equal(0, result.status, result.stderr)
  local lines = {}
  if runs then return json.decode(folder:read "stats.json").stiff or lines end
  for line in result.stdout:gmatch "stiff    ([^\n]+)" do lines[#lines + 1] = line end
  return lines
end

describe("advice", function()
  for _, arguments in ipairs { "check scene.lua", "run scene.lua -f 1-2" } do
    it("of `" .. arguments .. "` tells of a drag that is solved exactly", function()
      assert.same({ "drag1: k dt = 16; treated exactly", "spring1: omega dt = 50; treated exactly" },
        advice(arguments, head .. [[
return rapid.create { fps = 24, points = one } :attribute { mass = 2 }
  :drag { linear = 16 * 24 } :spring { stiffness = 2 * 1200 ^ 2 } :gravity {} :solve {}]]))
    end)

    it("of `" .. arguments .. "` tells what an action would need", function()
      local lines = advice(arguments, sun:format "")
      assert.equal(1, #lines)
      local step, error, substeps, less = lines[1]:match('^action "sun": omega dt = (%S+) at 1 sub%-step; '
        .. "estimated error (%S+) m; (%d+) sub%-steps would give (%S+) m$")
      assert.equal("1.9", step, lines[1])
      assert.equal("8", substeps)
      -- The true errors of the first frame, from the closed form; the summary reports one digit.
      for n, reported in pairs { [1] = tonumber(error), [8] = tonumber(less) } do
        local folder = command.folder()
        folder:write("scene.lua", sun:format("substeps = " .. n))
        assert.equal(0, command.rapid("run scene.lua -f 1-2 -o a.####.csv --quiet", { cwd = folder.path }).status)
        local file = assert(io.open(folder.path .. "/a.0002.csv"))
        local x, z = file:read "*a":match "\n%d+,([^,]+),[^,]+,([^,]+)"
        file:close()
        local t = omega / 24
        local wrong = math.sqrt((x - math.cos(t)) ^ 2 + (z - 2 / omega * math.sin(t)) ^ 2)
        assert.near(1, reported / wrong, 0.55)
      end
    end)
  end

  it("is in the summary of a run only if more substeps help", function()
    local summary = rapid("run scene.lua -f 1-2", sun:format "").stdout
    assert.match('\nlook at  action "sun" is stiff: estimated error [%d.]+ c?m; 8 substeps would give [%d.]+ [cm]?m\n',
      summary)
    assert.match("\nresult   all fine\n", rapid("run scene.lua -f 1-2", head .. [[
return rapid.create { fps = 24, points = one } :drag { linear = 16 * 24 } :solve {}]]).stdout)
  end)

  it("is of points that are born, and by what they have", function()
    assert.same({ "drag1: k dt = 8; treated exactly" }, advice("check scene.lua", head .. [[
return rapid.create { fps = 24 }
  :emit { source = rapid.mesh.sphere {}, rate = 1e6, birth = "begin", attributes = { thick = 8 * 24 } }
  :drag { linear = rapid.attr "thick" } :solve {}]]))
  end)

  it("is nothing where nothing is stiff, and where a tolerance chooses the sub-steps", function()
    assert.same({}, advice("check scene.lua", head ..
      "return rapid.create { points = one } :drag { linear = 1 } :solve {}"))
    for _, arguments in ipairs { "check scene.lua", "run scene.lua -f 1-3" } do
      assert.same({}, advice(arguments, sun:format "tolerance = 1e-3"))
    end
    assert.equal("", rapid("run scene.lua -f 1-3 --quiet", sun:format "").stdout)
  end)

  it("is of the worst frame of a run, and in --stats", function()
    local text = head .. [[
return rapid.create { fps = 24, points = one }
  :drag { linear = function(f) return f.number == 5 and 240 or 24 end } :solve {}]]
    local reported = "drag1: k dt = 10; solved in closed form, with what else acts held through a sub-step"
    assert.same({ reported }, advice("run scene.lua -f 1-6", text))
    local result, folder = rapid("run scene.lua -f 1-6 --stats stats.json --quiet", text)
    assert.equal(0, result.status)
    local file = assert(io.open(folder.path .. "/stats.json"))
    assert.same({ reported }, json.decode(file:read "*a").stiff)
    file:close()
  end)

  it("of coupled points gives no errors, which a sample of them would not have", function()
    assert.same({ 'action "sun": omega dt = 0.95 at 2 sub-steps' }, advice("run scene.lua -f 1-2", head .. [[
return rapid.create { fps = 24, points = rapid.points.from { P = {{1, 0, 0}, {2, 0, 0}} } } :distance { within = 2 }
  :action("sun", function(p) p.force = p.force - 45.6 ^ 2 * p.P end) :solve { substeps = 2 }]]))
  end)

  it("of check changes nothing about what is an error: a frame that fails is for the run to tell", function()
    local result = rapid("check scene.lua", head .. [[
return rapid.create { points = one } :points("fails", function(_, f) if f.number > 3 then error "later" end end)
  :solve {}]])
    assert.equal(0, result.status)
    assert.equal("", result.stderr)
  end)

  -- Points around a torus, attracted to its surface: the stiffness at first, and the worst error after two seconds.
  local function drawn(core)
    return rapid("run scene.lua -f 1-48 --stats stats.json", head .. ([[
return rapid.create { fps = 24, points = rapid.points.grid { size = {3, 3, 3}, spacing = 0.5 } }
  :attract { shape = rapid.mesh.torus { radius = 0.6, tube = 0.22 }%s } :solve { substeps = 2 }]]):format(core))
  end

  it("names core where a surface draws without bound, of a size that is resolved", function()
    local bare, folder = drawn("")
    local core = tonumber(bare.stderr:match "give core,[^\n]* from (%S+) m on 1 substep resolves it")
    assert.near((16 / 24 ^ 2) ^ (1 / 3), core, 0.006, bare.stderr)
    assert.truthy(bare.stderr:find('scene.lua:4: node "attract1": without core its pull is unbounded', 1, true))
    local with, folder_with = drawn(", core = " .. core)
    assert.falsy(with.stderr:find("core", 1, true), with.stderr)
    assert.truthy(json.decode(folder:read "stats.json").stiff)
    assert.is_nil(json.decode(folder_with:read "stats.json").stiff)
    local function median(of) return json.decode(of:read "stats.json").frames[48].error.position_p50 end
    assert.truthy(median(folder) > 1, bare.stdout)
    -- 1.5 (ratio of reported to true) (omega dt)²/24 of 12 radians, about 2 m: a quarter of a radian per substep.
    assert.truthy(median(folder_with) < 0.1, with.stdout)
  end)

  it("says that sub-steps are no remedy where they make nothing better", function()
    local lines = advice("run scene.lua -f 1-2", [[
local rapid = require "rapid"
return rapid.create { fps = 24, points = rapid.points.from { P = {{0.01, 0, 0}} } } :attract {} :solve {}]])
    local reported = "; they are no remedy near a place where a force has no bound: attract has core"
    assert.truthy(lines[1]:find(reported, 1, true), lines[1])
  end)
end)
