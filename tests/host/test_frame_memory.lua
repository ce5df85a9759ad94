-- The memory of a run does not grow with its number of frames.
local amount = require "tests.amount"
local json = require "dkjson"
local scene = require "testing.scene"

-- Returns a run's peak memory in MiB after this many frames.
local function peak(text, frames, arguments)
  local result = scene.command("run", text, ("-f 1-%d --threads 2 %s"):format(frames, arguments or ""))
  assert.equal("", result.stderr)
  return tonumber(result.stdout:match "([%d.]+) MiB of memory"), result.stdout
end

-- A ball that is a new level set of about 400 kB in each frame.
local ball = [[return rapid.create { points = two } :collide { shape = function(frame)
  return rapid.levelset.sphere { radius = 0.5 + 0.001 * (frame.number % 97), voxel = 0.05 }
end } :gravity {} :solve {}]]

describe("the memory of a run", function()
  it("does not grow with its frames where they are small", function()
    local text = "return rapid.create { points = two } :points('k', function(p) p.v = p.v * 0.5 end) :gravity {} " ..
      ":solve {}"
    for _, arguments in ipairs { "", "--stats stats.json" } do
      local few, many = peak(text, 1000, arguments), peak(text, 20000, arguments)
      assert.truthy(many - few < 1, ("%g MiB after 1,000 frames, %g after 20,000 %s"):format(few, many, arguments))
    end
    assert.equal(20000, #json.decode(scene.folder:read "stats.json").frames)
  end)

  local it_if_thorough = amount.thorough and it or function() end

  it_if_thorough("does not grow where a function of the frame makes a level set in each", function()
    local few, many = peak(ball, 150), peak(ball, 450)
    assert.truthy(many - few < 1, ("%g MiB after 150 frames, %g after 450"):format(few, many))
  end)

  it_if_thorough("does not grow with pictures and files of points", function()
    local text = "return rapid.create { points = two } :collide { shape = rapid.shape.sphere {} } :gravity {} :solve {}"
    local files = "--size 32x18 -o picture.####.png -o points.####.csv"
    local few, many = peak(text, 100, files), peak(text, 1000, files)
    assert.truthy(many - few < 1, ("%g MiB after 100 frames, %g after 1,000"):format(few, many))
  end)

  it("is for large pictures no more than a refusal says, and nearly that where a floor fills them", function()
    for shape, least in pairs { ["plane {}"] = 0.6, ["sphere { radius = 0.5 }"] = 0.2 } do
      local text = "return rapid.create { points = two } :collide { shape = rapid.shape." .. shape .. " } :solve {}"
      local function of(size, more) return "--size " .. size .. " -o picture.####.png" .. (more or "") end
      local small, large = peak(text, 2, of "32x18"), peak(text, 2, of "2000x1500")
      local refused = scene.command("run", text, "-f 1-2 " .. of("2000x1500", " --memory 150M"))
      local reported = tonumber(refused.stderr:match "would need about (%d+) MiB")
      assert.truthy(large - small < 1.05 * reported and large - small > least * reported,
        ("%s: %g MiB in place of %g, %d told"):format(shape, large, small, reported))
    end
  end)

  -- The peak varies by a few MiB with the timing of collections; 300 surfaces take hundreds.
  it_if_thorough("holds no surface of earlier frames where pictures show it", function()
    local small = "--size 32x18 -o picture.####.png"
    local few, many = peak(ball, 150, small), peak(ball, 450, small)
    assert.truthy(many - few < 20, ("%g MiB after 150 pictures, %g after 450"):format(few, many))
  end)
end)
