% Prints what the readers in tools/matlab find: octave-cli read_all.m LOG.h5 DIAGNOSIS.json MODEL.toml
files = argv();
addpath(fullfile(fileparts(mfilename('fullpath')), '..', '..', 'tools', 'matlab'));
runs = stepvalve_read_log(files{1});
for run = runs
  printf('run %s %d %.17g %.17g\n', run.name, numel(run.channels.time), run.channels.angle(end), sum(run.channels.torque));
end
diagnosis = stepvalve_read_diagnosis(files{2});
printf('diagnosis %s %.17g\n', diagnosis.verdict, diagnosis.gain.rms_before);
model = stepvalve_read_model(files{3});
printf('model %s %.17g\n', model.friction.law, model.friction.coulomb_torque_nm);
effects = {};
if isfield(model, 'effect')
  effects = model.effect;
end
for index = 1:numel(effects)
  effect = effects{index};
  printf('effect %s', effect.id);
  keys = fieldnames(effect);
  for key = keys(~strcmp(keys, 'id')).'
    printf(' %s', key{1});
    printf(' %.17g', effect.(key{1}));
  end
  printf('\n');
end
