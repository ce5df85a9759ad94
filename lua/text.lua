-- Strings of attributes. A column holds a number for each string, the same for equal ones in the whole process. Each
-- state caches those that it has met, so that a kernel reads and writes by a table lookup, which traces support.
--
-- The functions are vararg, so that no trace starts at them, and compiled, since kernels call them.
local most = 65536 -- cached; the cache is cleared when full

-- native.text(number), native.number(text)
local function make(native)
  local strings, numbers, count = {}, {}, 0
  local function keep(...)
    local text, number = ...
    count = count + 1
    if count > most then
      for known in next, strings do strings[known] = nil end
      for known in next, numbers do numbers[known] = nil end
      count = 1
    end
    strings[number], numbers[text] = text, number
  end
  return {
    text = function(...)
      local number = ...
      local text = strings[number]
      if text == nil then
        text = native.text(number)
        keep(text, number)
      end
      return text
    end,
    number = function(...)
      local text = ...
      local number = numbers[text]
      if number == nil then
        number = native.number(text)
        keep(text, number)
      end
      return number
    end,
  }
end

return { make = make }
