% A whole experiment with a fake rig: start the server with `isiw serve sessions`, set ISIW_TOKEN, and run this.
% In your own, replace what is between the two lines of dashes by your hardware.

url = getenv('ISIW_URL');
if isempty(url)
  url = 'http://127.0.0.1:8473';
end
lab = isiw(url, getenv('ISIW_TOKEN'));

plan = struct();
plan.seed = 7;
plan.visit = struct('subject', 'P07', 'muscle', 'FCR');
plan.space = struct('low_ms', 0, 'high_ms', 320, 'reference', 'impact');
plan.strategy = struct('name', 'default', 'settings', struct('max_trials', 8));
plan.limits = struct('min_iti_s', 0.1);  % a real person needs 5 s or more: leave it out
lab.create('P07', plan);

while ~lab.stop
  [trial, isi_ms] = lab.ask();
  % -------------------------------------------------- set isi_ms in the hardware that times it, arm, fire, read back
  realised_ms = isi_ms + 0.5;
  mep_mv = 0.02 + 0.4 * exp(-((realised_ms - 90) / 25)^2) * exp(0.2 * randn());
  hit = trial ~= 2;
  % ------------------------------------------------------------------------------------------------------------------
  if hit
    lab.tell(trial, realised_ms, mep_mv);
  else
    lab.mistrial(trial, 'no impact');
  end
  fprintf('%d %.17g %.17g %d\n', trial, realised_ms, mep_mv, hit);
end

lab.note('coil at 5 mm; a = b & c, 12 µV');
estimate = lab.estimate();
fprintf('%s\n%s\n', lab.reason, estimate.text);
lab.close();
