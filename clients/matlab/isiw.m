classdef isiw < handle
% ISIW  Ask an isiw server which inter-stimulus interval comes next, and tell it what came of it.
%
%   lab = isiw('http://127.0.0.1:8473', token);
%   lab.create('P07', struct('seed', 7));      % or lab.resume('P07'), to continue a session that was closed
%   while ~lab.stop
%       [trial, isi_ms] = lab.ask();           % waits until the next stimulus is allowed
%       ...                                    % your hardware delivers the pair at isi_ms
%       lab.tell(trial, realised_ms, mep_mv);  % or lab.mistrial(trial, 'no impact')
%   end
%   lab.close();
%
% Every call can be repeated without doubling anything, so one whose answer is lost is repeated here. Where it is
% refused, an error says why and what to do. Each object is a client of its own, by a random key: what one was given,
% the server gives to no other. For MATLAB from R2019b on, and GNU Octave from 7 on.

  properties (SetAccess = private)
    id = '';          % the session
    trials = 0;       % how many have an outcome: the next one has this number
    stop = false;     % whether to stop now
    reason = '';      % why, or why not
    doubts = {};      % what looked like a slip in the last trial that was told
  end

  properties (Access = private)
    url
    token
    key               % of this client
    attempts = 10     % of a call that is not answered
    noted = 0
    asked = []        % the trial that was asked for and has no outcome
  end

  methods
    function this = isiw(url, token)
      % The server's address, and the token that it prints when it starts.
      this.url = regexprep(char(url), '/+$', '');
      this.token = char(token);
      [~, random] = fileparts(tempname());  % rand is the same in each new session of MATLAB
      this.key = regexprep([datestr(now, 'yyyymmddTHHMMSSFFF') '-' random], '[^A-Za-z0-9_-]', '-');
      this.key = this.key(1:min(end, 64));
    end

    function create(this, id, plan)
      % Begin a session. PLAN may have the fields seed, visit, space, strategy, limits and protocol, as a configuration.
      % Its field earlier has TMS alone that was given before: struct('mep_mv', [..], 'intensity_pct_rmt', [..]). A list of
      % one value needs double braces, {{0.9}}, as jsonencode makes a number of [0.9].
      if nargin < 3
        plan = struct();
      end
      pairs = {'id', char(id), 'client', this.key};
      for name = fieldnames(plan)'
        pairs(end + 1:end + 2) = {name{1}, jsonencode(plan.(name{1}))};
      end
      this.begin(id, this.post('/sessions', pairs));
    end

    function resume(this, id, lost_pulses, takeover)
      % Continue a session. A trial without an outcome becomes a mistrial. TAKEOVER is true to continue one that another
      % client was driving, such as MATLAB before it crashed: make sure that it has ended, and that its rig is disarmed.
      if nargin < 3
        lost_pulses = [];
      end
      if nargin < 4
        takeover = false;
      end
      pairs = {'lost_pulses', number(lost_pulses), 'client', this.key, 'takeover', truth(takeover)};
      this.begin(id, this.post(['/sessions/' char(id) '/resume'], pairs));
    end

    function [trial, isi_ms, intensity_pct_rmt] = ask(this)
      % The next trial's number and its ISI [ms], which is on disk as about to be delivered; the intensity to set for it
      % [% RMT], [] in a session whose pairs all have the usual one.
      if ~isempty(this.asked)
        error('isiw:TrialOpen', ['trial %d was requested and has no outcome; it may have been delivered. ' ...
              'Tell it, or call mistrial(%d, ''outcome unknown'').'], this.asked, this.asked);
      end
      answer = this.post(this.path('ask'), {'trial', number(this.trials), 'client', this.key});
      trial = answer.trial;
      isi_ms = answer.isi_ms;
      intensity_pct_rmt = answer.intensity_pct_rmt;
      this.asked = trial;
    end

    function tell(this, trial, isi_ms, mep_mv, confirm, intensity_pct_rmt)
      % The realised ISI [ms] ([] for TMS alone, as the trial lab.trials) and the MEP from peak to peak [mV]. CONFIRM is
      % true to confirm realised ISIs that are far from those asked, after the error isiw:InDoubt. INTENSITY_PCT_RMT is
      % the one that was set [% RMT]; it is needed where ask has answered one.
      if nargin < 5
        confirm = false;
      end
      if nargin < 6
        intensity_pct_rmt = [];
      end
      pairs = {'trial', number(trial), 'isi_ms', number(isi_ms), 'mep_mv', number(mep_mv), ...
               'client', this.key, 'confirm', truth(confirm), 'intensity_pct_rmt', number(intensity_pct_rmt)};
      this.conclude(this.post(this.path('tell'), pairs));
    end

    function alone(this, mep_mv, intensity_pct_rmt)
      % TMS alone, as the trial lab.trials: the MEP [mV] of a pulse at an intensity [% RMT], by default that of the pairs.
      if nargin < 3
        intensity_pct_rmt = [];
      end
      pairs = {'trial', number(this.trials), 'isi_ms', '', 'mep_mv', number(mep_mv), ...
               'intensity_pct_rmt', number(intensity_pct_rmt), 'client', this.key};
      this.conclude(this.post(this.path('tell'), pairs));
    end

    function tap(this, isi_ms, mep_mv)
      % A tap alone, as the trial lab.trials: the amplitude of what the MEP window would hold at this ISI [ms], [mV].
      pairs = {'trial', number(this.trials), 'isi_ms', number(isi_ms), 'mep_mv', number(mep_mv), 'pulse', 'false', ...
               'client', this.key};
      this.conclude(this.post(this.path('tell'), pairs));
    end

    function mistrial(this, trial, reason)
      % A trial was lost: it counts as a stimulus, and nothing is learnt from it.
      pairs = {'trial', number(trial), 'reason', char(reason), 'client', this.key};
      this.conclude(this.post(this.path('mistrial'), pairs));
    end

    function note(this, text)
      % A remark for the log.
      this.post(this.path('note'), {'text', char(text), 'key', this.new_key()});
    end

    function change(this, text)
      % That something changed that may bear on all later MEPs, such as the coil's place: the strategy learns of it.
      this.post(this.path('change'), {'text', char(text), 'key', this.new_key()});
    end

    function exclude(this, trial, reason)
      % Exclude a trial; nothing is erased.
      pairs = {'trial', number(trial), 'reason', char(reason), 'key', this.new_key()};
      this.take(this.post(this.path('exclude'), pairs));
    end

    function include(this, trial)
      % Let a trial count again that was excluded.
      this.take(this.post(this.path('include'), {'trial', number(trial), 'key', this.new_key()}));
    end

    function answer = estimate(this)
      % What is believed about the window.
      answer = this.call(@() webread([this.url this.path('estimate') '?errors=200'], this.options()));
    end

    function close(this)
      % Close the session: its log is complete.
      this.take(this.post(this.path('close'), {'close', '1'}));
    end
  end

  methods (Access = private)
    function whole = path(this, verb)
      if isempty(this.id)
        error('isiw:NoSession', 'No session was begun: call create or resume first. Nothing was sent.');
      end
      whole = ['/sessions/' this.id '/' verb];
    end

    function made = options(this)
      % Made for each call, as Octave's webwrite changes those that it is given.
      made = weboptions('Timeout', 60, 'ContentType', 'text', ...
                        'HeaderFields', {'Authorization', ['Bearer ' this.token]});
    end

    function key = new_key(this)
      % By which a repetition is known, however late it comes.
      this.noted = this.noted + 1;
      key = sprintf('%s-%d', datestr(now, 'yyyymmddTHHMMSSFFF'), this.noted);
    end

    function begin(this, id, answer)
      % From here on the calls are of this session; after a refusal they stay of the one before.
      this.id = char(id);
      this.take(answer);
      this.asked = [];
    end

    function take(this, answer)
      this.trials = answer.trials;
      this.stop = answer.stop;
      this.reason = answer.reason;
    end

    function conclude(this, answer)
      if isequal(this.asked, answer.trial)
        this.asked = [];
      end
      this.trials = max(this.trials, answer.trial + 1);
      this.stop = answer.stop;
      this.reason = answer.stop_reason;
      this.doubts = answer.doubts;
      if ~isempty(answer.doubts)
        warning('isiw:Doubt', '%s', strjoin(cellstr(answer.doubts), ' '));
      end
    end

    function answer = post(this, path, pairs)
      answer = this.call(@() webwrite([this.url path '?errors=200'], pairs{:}, this.options()));
    end

    function answer = call(this, send)
      % Send until it is answered, some times; wait where the server says how long, also for a long rest.
      attempt = 1;
      while true
        try
          text = send();
        catch problem
          if attempt >= this.attempts
            rethrow(problem);
          end
          pause(0.2 * attempt);
          attempt = attempt + 1;
          continue
        end
        answer = jsondecode(text);
        if answer.ok
          return
        end
        rests = strcmp(answer.error.type, 'TooEarly');
        if isempty(answer.error.retry_s) || (attempt >= this.attempts && ~rests)
          error(['isiw:' answer.error.type], '%s', answer.error.message);
        end
        attempt = attempt + ~rests;
        pause(answer.error.retry_s);
      end
    end
  end
end

function text = truth(value)
  % True or false, as JSON has it.
  if value
    text = 'true';
  else
    text = 'false';
  end
end

function text = number(value)
  % A number with all its digits; none is an empty text.
  if isempty(value)
    text = '';
  elseif ~isscalar(value) || ~(isnumeric(value) || islogical(value)) || ~isreal(value)
    error('isiw:NoNumber', 'a single number is needed, not %d of class %s. Nothing was sent.', ...
          numel(value), class(value));
  else
    text = sprintf('%.17g', value);
  end
end
