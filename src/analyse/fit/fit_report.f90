!> What a fit has found: values with standard errors, correlations, what cannot be told apart, and the measurements before and
!> after.
module nocdyn_fit_report
  use nocdyn_comparisons, only: comparison_file, comparison_t, fit_files, left_out, of_damping, put_measurement, &
    shown_comparison
  use nocdyn_csv, only: text_cell
  use nocdyn_input, only: input_t
  use nocdyn_json, only: json_t
  use nocdyn_kinds, only: wp
  use nocdyn_least_squares, only: solution_t
  use nocdyn_output_file, only: output_file_t
  use nocdyn_report_openings, only: append_notes, open_analysis_report
  use nocdyn_table_text, only: cell, padded
  use nocdyn_text, only: append, joined, quoted, rounded_text, string_t, to_text
  use nocdyn_text_buffer, only: text_buffer_t
  use nocdyn_unknowns, only: unknown_t
  implicit none (type, external)
  private

  public :: fit_csv, fit_text, put_fit

  real(wp), parameter :: confident = 1.959963984540054_wp   ! standard errors on either side of 95 % of a normal distribution
  real(wp), parameter :: strong = 0.95_wp                   ! correlations that are reported
  real(wp), parameter :: too_large = 4.0_wp                 ! variance of residuals over their deviations
  character(len=*), parameter :: line_end = new_line('a')

  type, public :: machine_fit_t
    type(unknown_t), allocatable :: unknowns(:)
    type(solution_t) :: solution
    type(comparison_t), allocatable :: before(:), after(:)   !! [measurements]
    integer :: starts = 1, best_start = 1, evaluations = 0
    real(wp) :: variance = 1.0_wp             !! of residuals over their deviations
    real(wp), allocatable :: error(:)         !! standard errors, [unknowns]
    logical, allocatable :: is_open(:)        !! whether a value is not determined, [unknowns]
    type(string_t), allocatable :: notes(:)   !! of the start first
  contains
    procedure :: conclude
  end type machine_fit_t

contains

  !> Finds standard errors and notes. Measurements without deviations are as exact as their residuals say.
  subroutine conclude(self)
    class(machine_fit_t), intent(inout) :: self
    character(len=:), allocatable :: line
    integer :: freedoms, i, k

    associate (solution => self%solution, n => size(self%unknowns))
      freedoms = size(solution%residuals) - (n - size(solution%undetermined, 2) - count(solution%is_at_bound))
      self%variance = 1.0_wp
      if (freedoms > 0) self%variance = 2.0_wp * solution%cost / freedoms
      solution%covariance = self%variance * solution%covariance
      allocate (self%error(n), self%is_open(n))
      do i = 1, n
        self%error(i) = sqrt(max(0.0_wp, solution%covariance(i, i)))
        self%is_open(i) = .false.
        do k = 1, size(solution%undetermined, 2)
          self%is_open(i) = self%is_open(i) .or. abs(solution%undetermined(i, k)) > 0.01_wp
        end do
      end do
      do k = 1, size(solution%undetermined, 2)
        call append(self%notes, combination_text(self, solution%undetermined(:, k)))
      end do
      do i = 1, n
        if (solution%is_at_bound(i)) then
          call append(self%notes, self%unknowns(i)%path // ' is at its bound: the best value lies beyond')
        end if
        do k = 1, i - 1
          if (self%is_open(i) .or. self%is_open(k) .or. .not. self%error(i) * self%error(k) > 0) cycle
          associate (correlation => solution%covariance(i, k) / (self%error(i) * self%error(k)))
            if (abs(correlation) > strong) then
              call append(self%notes, self%unknowns(k)%path // ' and ' // self%unknowns(i)%path // &
                                      ' are hardly told apart: correlation ' // rounded_text(correlation, 4))
            end if
          end associate
        end do
      end do
      if (self%variance > too_large .and. any(self%after%measurement%deviation > 0)) then
        call append(self%notes, 'the differences are ' // rounded_text(sqrt(self%variance), 3) // ' times the standard ' // &
                                'deviations of the measurements: the machine is another one, or there is a better solution ' // &
                                'far from the start, which --starts 8 may find')
      end if
      do i = 1, size(self%after)
        line = left_out(self%after(i))
        if (line /= '') call append(self%notes, quoted(self%after(i)%measurement%name) // ': ' // line)
      end do
      if (.not. solution%has_converged) call append(self%notes, 'the fit has not converged: the values are the best so far')
    end associate
  end subroutine conclude

  !> What a direction that no measurement sees leaves open, e.g. "only the sum of the flexibilities of ... is determined".
  function combination_text(self, direction) result(text)
    type(machine_fit_t), intent(in) :: self
    real(wp), intent(in) :: direction(:)   !! of relative changes
    character(len=:), allocatable :: text
    real(wp), parameter :: part = 0.01_wp, accuracy = 1.0e-3_wp
    integer, allocatable :: members(:)
    real(wp), allocatable :: share(:), value(:)
    type(string_t), allocatable :: names(:)
    integer :: i

    allocate (members, source=pack([(i, i=1, size(direction))], abs(direction) > part))
    allocate (names(size(members)))
    do i = 1, size(members)
      names(i)%text = self%unknowns(members(i))%path
    end do
    allocate (share, source=direction(members))
    allocate (value, source=self%solution%x(members))
    if (size(members) == 1) then
      text = 'no measurement depends on ' // names(1)%text
      return
    end if
    text = 'cannot be told apart: ' // joined(names, ', ')
    if (vanishes(share / value)) then
      text = text // ': only the sum of their reciprocals (of stiffnesses, the flexibilities) is determined'
    else if (vanishes(share * value)) then
      text = text // ': only their sum is determined'
    else if (size(members) == 2 .and. vanishes([share(1), -share(2)])) then
      text = text // ': only their ratio is determined'
    else if (vanishes(share)) then
      text = text // ': only their product is determined'
    else
      text = text // ': they may change by'
      do i = 1, size(members)
        text = text // trim(merge(' ', ',', i == 1)) // ' ' // rounded_text(100.0_wp * share(i) / maxval(abs(share)), 3) // ' %'
      end do
      text = text // ' together'
    end if

  contains

    pure logical function vanishes(terms)
      real(wp), intent(in) :: terms(:)

      vanishes = abs(sum(terms)) <= accuracy * sum(abs(terms))
    end function vanishes

  end function combination_text

  !> The table of the unknowns and that of the measurements.
  function fit_text(file, self) result(text)
    character(len=*), intent(in) :: file
    type(machine_fit_t), intent(in) :: self
    character(len=:), allocatable :: line, text
    type(text_buffer_t) :: report
    integer :: i, width

    call append_notes(report, file, self%notes)
    line = file // ': ' // to_text(size(self%unknowns)) // ' unknowns fitted to ' // to_text(size(self%solution%residuals)) // &
           ' values in ' // to_text(self%evaluations) // ' evaluations'
    if (self%starts > 1) line = line // ', best from start ' // to_text(self%best_start) // ' of ' // to_text(self%starts)
    call report%append_line(line)
    width = maxval([7, (len(self%unknowns(i)%path), i=1, size(self%unknowns))])
    call report%append_line('  ' // padded('unknown', width) // cell('before') // cell('fitted') // cell('std. error') // &
                            cell('from (95 %)') // cell('to'))
    do i = 1, size(self%unknowns)
      associate (x => self%solution%x(i), error => self%error(i), one => self%unknowns(i))
        line = '  ' // padded(one%path, width) // cell(one%before) // cell(x)
        if (self%is_open(i)) then
          line = line // '  not determined'
        else if (self%solution%is_at_bound(i)) then
          line = line // '  at its bound'
        else
          line = line // cell(error) // cell(x - confident * error) // cell(x + confident * error) // '  ' // one%unit
        end if
        call report%append_line(line)
      end associate
    end do
    width = maxval([11, (len(self%after(i)%measurement%name) + len(', damping ratios'), i=1, size(self%after))])
    call report%append_line('  ' // padded('measurement', width) // cell('bias before') // cell('bias after') // &
                            cell('spread before') // cell('spread after') // cell('correlation'))
    do i = 1, size(self%after)
      call report%append_line(line_on(shown_comparison(self%before(i)), shown_comparison(self%after(i))))
      if (allocated(self%after(i)%measured_damping)) then
        call report%append_line(line_on(of_damping(self%before(i)), of_damping(self%after(i))))
      end if
    end do
    text = report%text()

  contains

    !> A measurement before and after.
    function line_on(before, after) result(line)
      type(comparison_t), intent(in) :: before, after
      character(len=:), allocatable :: line

      line = '  ' // padded(after%measurement%name, width) // cell(before%bias) // cell(after%bias) // cell(before%spread) // &
             cell(after%spread) // cell(after%correlation)
      if (after%measurement%unit /= '1') line = line // '  ' // after%measurement%unit
    end function line_on

  end function fit_text

  !> Writes fit.csv: a row for each unknown.
  subroutine fit_csv(self, file)
    type(machine_fit_t), intent(in) :: self
    type(output_file_t), intent(inout) :: file
    integer :: i, k

    call file%put('unknown,unit,before,fitted,standard_error,low,high,is_determined,is_at_bound')
    do k = 1, size(self%unknowns)
      call file%put(',correlation_' // to_text(k))
    end do
    call file%put(line_end)
    do i = 1, size(self%unknowns)
      associate (one => self%unknowns(i))
        call file%put(text_cell(one%path) // ',' // one%unit)
        call file%put_numbers([one%before, self%solution%x(i), self%error(i), one%low, one%high], ',')
        call file%put(',' // trim(merge('yes', 'no ', .not. self%is_open(i))) // ',' // &
                      trim(merge('yes', 'no ', self%solution%is_at_bound(i))))
        call file%put_numbers(correlations(self, i), ',')
        call file%put(line_end)
      end associate
    end do
  end subroutine fit_csv

  !> With all unknowns; 0 where one has no standard error.
  pure function correlations(self, i)
    type(machine_fit_t), intent(in) :: self
    integer, intent(in) :: i
    real(wp) :: correlations(size(self%unknowns))

    correlations = 0.0_wp
    where (self%error * self%error(i) > 0) correlations = self%solution%covariance(:, i) / (self%error * self%error(i))
  end function correlations

  !> The members of fit.json: the unknowns with their errors, covariances and correlations, and the measurements before and after.
  subroutine put_fit(json, input, self)
    type(json_t), intent(inout) :: json
    type(input_t), intent(in) :: input
    type(machine_fit_t), intent(in) :: self
    type(comparison_t) :: after, before   ! of damping ratios
    integer :: i

    call open_analysis_report(json, input)
    call json%put('notes', self%notes)
    if (size(input%groups_named('response')) > 0) then
      associate (response => input%groups(input%position('response')))
        if (response%has_value('body')) call json%put('body', response%text('body'))   ! whose speed that of orders is
      end associate
    end if
    call json%put('values', size(self%solution%residuals))
    call json%put('evaluations', self%evaluations)
    call json%put('has_converged', self%solution%has_converged)
    call json%put('sum_of_squares', 2.0_wp * self%solution%cost)
    call json%open_list('unknowns')
    do i = 1, size(self%unknowns)
      call json%open()
      associate (one => self%unknowns(i))
        call json%put('target', one%path)
        call json%put('unit', one%unit)
        call json%put('before', one%before)
        call json%put('fitted', self%solution%x(i))
        call json%put('standard_error', self%error(i))
        call json%put('is_determined', .not. self%is_open(i))
        call json%put('is_at_bound', self%solution%is_at_bound(i))
        call json%put('low', one%low)
        call json%put('high', one%high)
        call json%put('covariance', self%solution%covariance(:, i))
        call json%put('correlation', correlations(self, i))
      end associate
      call json%close()
    end do
    call json%close_list()
    call json%open_list('measurements')
    do i = 1, size(self%after)
      call json%open()
      call put_measurement(json, self%after(i)%measurement)
      call json%put('file', comparison_file(self%after(i), fit_files))
      if (self%after(i)%measurement%deviation > 0) call json%put('deviation', self%after(i)%measurement%deviation)
      call json%put('values', size(self%after(i)%measured))
      call json%put('bias_before', self%before(i)%bias)
      call json%put('bias', self%after(i)%bias)
      call json%put('spread_before', self%before(i)%spread)
      call json%put('spread', self%after(i)%spread)
      if (self%after(i)%has_correlation) call json%put('correlation', self%after(i)%correlation)
      before = of_damping(self%before(i))
      after = of_damping(self%after(i))
      if (size(after%measured) > 0) then
        call json%put('damping_bias_before', before%bias)
        call json%put('damping_bias', after%bias)
        call json%put('damping_spread_before', before%spread)
        call json%put('damping_spread', after%spread)
      end if
      call json%close()
    end do
    call json%close_list()
    call json%close()
  end subroutine put_fit

end module nocdyn_fit_report
