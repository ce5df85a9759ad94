-- assign_goals: points of one group are places for the others, which take one each; the places then go.
--
-- Whatever points can be born on is so a shape to go to: a surface, a volume, points of a file. At each frame points
-- that have no place yet get one of those that have come:
--
--   id         the k-th point by id the k-th place by id, and again from the first where places are fewer
--   random     the same with the places shuffled
local rapid = require "rapid"

local function by_id(a, b) return a.id < b.id end

-- Points are in the order of their ids, as a rule.
local function order_by_id(list)
  for k = 2, #list do
    if list[k].id < list[k - 1].id then return table.sort(list, by_id) end
  end
end

local function by_number(a, b)
  if a.number ~= b.number then return a.number < b.number end
  return a.id < b.id
end

return rapid.node {
  name = "assign_goals",
  doc  = "Gives points places to go to: the points of a group, which it removes.",
  params = {
    from = { "string", required = true, doc = "the group of the points that are places" },
    by   = { "string", default = "id", choices = { "id", "random" }, doc = "who gets which" },
    into = { "group", default = "assigned", doc = "who has a place is put into this group" },
  },
  makes = { goal = {0, 0, 0} },
  detail = function(points, _, params)
    local places, takers = {}, {}
    for i = 1, #points do
      local p = points[i]
      if p:within(params.from) then
        places[#places + 1] = { P = p.P, id = p.id, number = p:rand(1) }
        p:kill()
      end
    end
    if #places == 0 then return end
    for i = 1, #points do
      local p = points[i]
      if not (p:within(params.from) or p:within(params.into)) then takers[#takers + 1] = { p = p, id = p.id } end
    end
    order_by_id(takers)
    order_by_id(places)
    if params.by == "random" then table.sort(places, by_number) end
    for k, taker in ipairs(takers) do
      taker.p.goal = places[(k - 1) % #places + 1].P
      taker.p:join(params.into)
    end
  end,
}
