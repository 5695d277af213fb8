function model = stepvalve_read_model(file)
% STEPVALVE_READ_MODEL  A model file, such as model-extended.toml, as a struct, in MATLAB and in GNU Octave.
%
%   model = stepvalve_read_model('model-extended.toml')
%   model.friction.coulomb_torque_nm      a number, as it stands in the file
%   model.effect{1}.id, .gain             effects, in the file's order
%
%   Numbers with a unit ("17deg") are texts. It reads what model files hold: tables, arrays of tables, texts, numbers, truth
%   values, arrays; and refuses everything else with the line's number.
  lines = strsplit(strrep(fileread(file), sprintf('\r'), ''), sprintf('\n'));
  model = struct();
  place = {};
  number = 0;
  while number < numel(lines)
    number = number + 1;
    line = strtrim(without_comment(lines{number}));
    if isempty(line)
      continue
    end
    if line(1) == '['
      [model, place] = enter(model, line, file, number);
      continue
    end
    equals = find(line == '=', 1);
    if isempty(equals)
      refuse(file, number, line);
    end
    key = strtrim(line(1:equals - 1));
    text = strtrim(line(equals + 1:end));
    % An array may go on over several lines.
    while sum(bare(text) == '[') > sum(bare(text) == ']') && number < numel(lines)
      number = number + 1;
      text = [text ' ' strtrim(without_comment(lines{number}))];
    end
    [value, good] = value_of(text);
    if ~good || ~isvarname(key)
      refuse(file, number, line);
    end
    model = put(model, [place {key}], value);
  end
end

function refuse(file, number, line)
  error('%s:%d: found `%s`, expected a table or key = value', file, number, line);
end

function [model, place] = enter(model, line, file, number)
  is_list = strncmp(line, '[[', 2);
  if line(end) ~= ']'
    refuse(file, number, line);
  end
  name = strtrim(strrep(strrep(line, '[', ''), ']', ''));
  parts = strsplit(name, '.');
  if any(cellfun(@(part) ~isvarname(part), parts))
    refuse(file, number, line);
  end
  place = {};
  here = model;
  for index = 1:numel(parts)
    place{end + 1} = parts{index};
    there = isstruct(here) && isfield(here, parts{index});
    if is_list && index == numel(parts)
      count = 0;
      if there
        count = numel(here.(parts{index}));
      end
      place{end + 1} = count + 1;
      model = put(model, place, struct());
    elseif there && iscell(here.(parts{index}))
      % A table within the last one of a list.
      place{end + 1} = numel(here.(parts{index}));
      here = here.(parts{index}){end};
    elseif there
      here = here.(parts{index});
    else
      model = put(model, place, struct());
      here = struct();
    end
  end
end

function all = put(all, place, value)
  if isempty(place)
    all = value;
    return
  end
  step = place{1};
  if ischar(step)
    inner = struct();
    if isstruct(all) && isfield(all, step)
      inner = all.(step);
    elseif numel(place) > 1 && isnumeric(place{2})
      inner = {};
    end
    all.(step) = put(inner, place(2:end), value);
  else
    if step > numel(all)
      all{step} = struct();
    end
    all{step} = put(all{step}, place(2:end), value);
  end
end

function text = without_comment(text)
  quoted = false;
  for index = 1:numel(text)
    if text(index) == '"' && (index == 1 || text(index - 1) ~= '\')
      quoted = ~quoted;
    elseif text(index) == '#' && ~quoted
      text = text(1:index - 1);
      return
    end
  end
end

function text = bare(text)
  % Without what stands in quotes.
  text = regexprep(text, '"([^"\\]|\\.)*"', '');
end

function [value, good] = value_of(text)
  good = true;
  value = [];
  if isempty(text)
    good = false;
  elseif text(1) == '"' && numel(text) > 1 && text(end) == '"'
    value = strrep(strrep(text(2:end - 1), '\"', '"'), '\\', '\');
  elseif strcmp(text, 'true') || strcmp(text, 'false')
    value = strcmp(text, 'true');
  elseif text(1) == '[' && text(end) == ']'
    [value, good] = array_of(text(2:end - 1));
  else
    value = str2double(strrep(text, '_', ''));
    good = ~isnan(value) || strcmp(text, 'nan');
  end
end

function [value, good] = array_of(text)
  parts = {};
  depth = 0;
  quoted = false;
  from = 1;
  for index = 1:numel(text)
    letter = text(index);
    if letter == '"'
      quoted = ~quoted;
    elseif ~quoted
      depth = depth + (letter == '[') - (letter == ']');
    end
    if letter == ',' && depth == 0 && ~quoted
      parts{end + 1} = strtrim(text(from:index - 1));
      from = index + 1;
    end
  end
  parts{end + 1} = strtrim(text(from:end));
  parts = parts(~cellfun(@isempty, parts));
  values = cell(1, numel(parts));
  good = true;
  for index = 1:numel(parts)
    [values{index}, one] = value_of(parts{index});
    good = good && one;
  end
  % Numbers as a row, rows of one length as a matrix, all else as a list.
  if all(cellfun(@(one) isnumeric(one) && isscalar(one), values))
    value = [values{:}];
  elseif all(cellfun(@isnumeric, values)) && numel(unique(cellfun(@numel, values))) == 1
    value = vertcat(values{:});
  else
    value = values;
  end
end
