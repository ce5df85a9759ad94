-- Values in messages. Graph code reads messages too (pcall), so no address may be in one.
local describe = {}

-- "nil", "a number", "a table"
function describe.kind(value)
  return value == nil and "nil" or "a " .. type(value)
end

-- The frame and the step are taken for numbers: they are shown with one that they have.
local function text_of_cdata(value)
  local text = tostring(value)
  if text:find "^frame " then return "the frame (frame.time is a number)" end
  if text == "a step" then return "the step (step.time is a number)" end
  return text
end

-- A value as it is written, where it is short; any other by its type.
function describe.value(value)
  local kind = type(value)
  if kind == "string" then return ("%q"):format(value) end
  if kind == "cdata" then return text_of_cdata(value) end
  if kind == "number" or kind == "boolean" then return tostring(value) end
  return describe.kind(value)
end

-- The same, of a value that a formula is given: a number or a vec3 as it is written.
function describe.operand(value)
  local kind = type(value)
  if kind == "number" or kind == "cdata" then return describe.value(value) end
  return describe.kind(value)
end

-- A value that was used as a name.
function describe.name(value)
  return type(value) == "string" and value or describe.value(value)
end

return describe
