-- rapid check --races: finds state that a kernel stores between points and that neither the bytecode analysis nor the
-- comparison of shared values, which stops at 10,000 values, can find.
local scene = require "testing.scene"

-- A table inside another table of the kernel is not followed.
local hidden = "local held = { box } local kept = held[1] "

local function check(chain, before, arguments)
  local text = ([[
local box = { n = 0 } %s ballast = {} for i = 1, 20000 do ballast[i] = i end
return rapid.create { points = two } :attribute { n = 0 }
  %s]]):format(before or "", chain)
  return scene.command("check", text, arguments or "--races")
end

local remedy = "; a kernel must not remember other points: store values in an attribute of the point, or compute " ..
  "them once for all points in a :detail\n"

describe("rapid check --races", function()
  it("finds a count of the points before, with the node, the attribute, the point and both values", function()
    local chain = (":points('idle', function(p) p.n = p.n end)\n  :points('count', function(p) %s" ..
      "kept.n = kept.n + 1 p.n = kept.n end) :solve {}"):format(hidden)
    local result = check(chain)
    assert.equal("", result.stdout)
    assert.equal('scene.lua:4: node "count": frame 2: n of point id 0 is 1 in the order of the points, and 2 in ' ..
      "reverse order" .. remedy, result.stderr)
    assert.equal(1, result.status)
    assert.equal(0, check(chain, nil, "").status) -- the bytecode analysis does not find it
  end)

  it("finds what depends on the points that a state has seen, in whatever order", function()
    local result = check((":points('seen', function(p, frame) %sif frame.number == 2 then kept.n = kept.n + 1 else " ..
      "p.n = kept.n end end) :solve {}"):format(hidden))
    assert.equal('scene.lua:3: node "seen": frame 3: n of point id 0 is 2 in the order of the points, and 1 if ' ..
      "every other point is processed by a second Lua state" .. remedy, result.stderr)
    assert.equal(1, result.status)
  end)

  it("names the action whose doing shows after Solve", function()
    local result = check((":action('still', function(p) p.v = p.v end)\n  :action('drift', function(p) %s" ..
      "kept.n = kept.n + 1 p.v = vec3(kept.n, 0, 0) end) :gravity {} :solve {}"):format(hidden))
    assert.truthy(result.stderr:find('^scene.lua:4: node "drift": frame 2: P of point id 0 after node "solve1" is ' ..
      "vec3%([^)]+%) in the order of the points, and vec3%([^)]+%) in reverse order; "), result.stderr)
    assert.equal(1, result.status)
  end)

  it("finds groups, deaths and tests of a point that depend on the order", function()
    for what, chain in pairs {
      ["point id 0 is out of the group late in the order of the points, and in it in reverse order"] =
        ":points('k', function(p) %s kept.n = kept.n + 1 if kept.n %% 2 == 0 then p:join 'late' end end) :solve {}",
      ["the id at index 1 is 0 in the order of the points, and 1 in reverse order"] =
        ":points('k', function(p) %s kept.n = kept.n + 1 if kept.n %% 2 == 0 then p:kill() end end) :solve {}",
      ["point id 0 is in the group odd in the order of the points, and out of it in reverse order"] =
        ":group { name = 'odd', where = function() %s kept.n = kept.n + 1 return kept.n %% 2 == 1 end } :solve {}",
    } do
      local result = check(chain:format(hidden))
      assert.truthy(result.stderr:find(what, 1, true), result.stderr)
      assert.equal(1, result.status)
    end
  end)

  it("passes kernels that see their own point alone, of every kind, and loads the graph in silence", function()
    local result = check([[:detail("d", function(points) points.detail.n = points:sum "n" end)
  :points("k", function(p, frame)
    p.n = p.n + p:rand(1, frame) + p.index + frame.detail.n
    if p.id == 0 then p:join "first" end
    if p:within "first" and frame.number == 3 then p:kill() end
  end)
  :delete { where = function(p) return p.n < 0 end }
  :action("a", function(p, step) p.v = p.v + vec3(p:rand(2, step), step.time, 0) * step.dt end)
  :swirl { group = "first" }
  :gravity {} :solve { substeps = 3 }
  :points("after", function(p) p.n = -p.n end)]], "print 'once'")
    assert.equal("", result.stderr)
    assert.equal(0, result.status)
    local _, times = result.stdout:gsub("once", "")
    assert.equal(1, times)
    assert.truthy(result.stdout:find("frames 2 to 3: bit-identical in every order of the points, and in two Lua " ..
      "states\n",
      1, true), result.stdout)
  end)

  it("reports an error in a frame with status 1, as a run does", function()
    local result = check(":points('k', function() error 'too hot' end) :solve {}")
    assert.equal('scene.lua:3: node "k": too hot (point id 0, frame 2)\n', result.stderr)
    assert.equal(1, result.status)
  end)

  it("compares the frames of -f, and says so where there was no point in them", function()
    local text = [[
local box = { n = 0 } ballast = {} for i = 1, 20000 do ballast[i] = i end
return rapid.create {} :emit { source = rapid.points.from { P = {{0, 0, 0}} }, impulse = { [9] = 3 },
    attributes = { n = 0 } }
  :points("count", function(p)
    local held = { box } local kept = held[1] kept.n = kept.n + 1 p.n = kept.n end) :solve {}]]
    local early = scene.command("check", text, "--races")
    assert.equal("warning: frames 2 to 3 have no points to compare; choose later frames, such as -f 25-27\n",
      early.stderr)
    assert.equal(0, early.status)
    local late = scene.command("check", text, "--races -f 8-10")
    assert.truthy(late.stderr:find('node "count": frame 9: n of point id 0 is', 1, true), late.stderr)
    assert.equal(1, late.status)
    local without = scene.command("check", text, "-f 8-10")
    assert.equal("-f chooses the frames of --races; give both, or neither\n",
      without.stderr)
    assert.equal(2, without.status)
  end)

  it("takes no number of threads", function()
    local result = check(":solve {}", nil, "--races --threads 2")
    assert.equal("--races visits the points in several orders on one thread; remove --threads\n",
      result.stderr)
    assert.equal(2, result.status)
  end)
end)
