function diagnosis = stepvalve_read_diagnosis(file)
% STEPVALVE_READ_DIAGNOSIS  diagnosis.json as a struct, in MATLAB and in GNU Octave (7 or later).
%
%   diagnosis = stepvalve_read_diagnosis('diagnosis.json')
%   diagnosis.verdict                     'explained', 'no-discrepancy', 'ambiguous', ...
%   diagnosis.causes(1).id                the first cause, with .parameters.factor.value and .ci95
%   diagnosis.gain.rms_before, .rms_after on the runs kept aside
  diagnosis = jsondecode(fileread(file));
  if ~isfield(diagnosis, 'verdict')
    error('%s: found no verdict, expected a diagnosis.json', file);
  end
end
