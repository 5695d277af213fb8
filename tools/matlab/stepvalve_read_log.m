function runs = stepvalve_read_log(file)
% STEPVALVE_READ_LOG  The runs of run.h5, residuals.h5 or any other valve-log, in MATLAB and in GNU Octave.
%
%   runs = stepvalve_read_log('run.h5') is a struct array: runs(1).name, and runs(1).channels with a column for each
%   channel in SI units (rad, N*m, Pa, s, degC): runs(1).channels.time, .angle, .torque, ...
%
%   plot(runs(1).channels.time, runs(1).channels.angle)
%
%   Octave writes names as identifiers: the run closed-loop is called closed_loop there.
  if exist('OCTAVE_VERSION', 'builtin')
    runs = with_octave(file);
  else
    runs = with_matlab(file);
  end
end

function runs = with_octave(file)
  % Only the runs: Octave can't read the texts of other groups.
  all = load('-hdf5', file, 'runs');
  if ~isfield(all, 'runs')
    error('%s: found no runs, expected a valve-log', file);
  end
  names = fieldnames(all.runs);
  runs = struct('name', {}, 'channels', {});
  for index = 1:numel(names)
    group = all.runs.(names{index});
    keys = fieldnames(group);
    channels = struct();
    for key = 1:numel(keys)
      values = group.(keys{key});
      if isnumeric(values) && ~isempty(values)
        channels.(keys{key}) = double(values(:));
      end
    end
    runs(index) = struct('name', names{index}, 'channels', channels);
  end
end

function runs = with_matlab(file)
  groups = h5info(file, '/runs').Groups;
  runs = struct('name', {}, 'channels', {});
  for index = 1:numel(groups)
    channels = struct();
    for dataset = groups(index).Datasets.'
      if any(strcmp(dataset.Datatype.Class, {'H5T_FLOAT', 'H5T_INTEGER'}))
        values = h5read(file, [groups(index).Name '/' dataset.Name]);
        channels.(matlab.lang.makeValidName(dataset.Name)) = double(values(:));
      end
    end
    name = strrep(groups(index).Name, '/runs/', '');
    runs(index) = struct('name', name, 'channels', channels);
  end
end
