!> The stages of a one-step method on a block of lanes, and the sums that are formed of them.
module nocdyn_stages
  use nocdyn_combinations, only: combination, combination_t, combine, padded_columns, set_offsets, strip
  use nocdyn_finite, only: is_finite
  use nocdyn_kinds, only: wp
  use nocdyn_system, only: system_t
  use nocdyn_trial, only: park, park_infinities, trial_not_finite, trial_t
  implicit none (type, external)
  private

  public :: set_weights, share_places, allocate_stages, inner_state, update_state, estimate_error, expand

  type, public :: stages_t
    integer :: step = 0                                !! stages that a step needs
    integer :: all = 0                                 !! those and the ones that only the solution inside the step needs
    type(combination_t), allocatable :: inner(:)       !! states that the stages are taken at, row by row
    type(combination_t) :: update                      !! weights of y_new
    type(combination_t) :: error                       !! weights of the deviation
    type(combination_t) :: coarse_error                !! weights of the coarse deviation; no terms: there is none
    type(combination_t), allocatable :: dense(:)       !! weights of each power of theta = (time - t) / h
    integer :: places = 0                              !! for stages in `k`
    integer, allocatable :: place(:)                   !! of each stage in `k`, [all]
    real(wp), allocatable :: k(:, :, :)                !! the stages, shape [lanes, padded columns, places]
    real(wp), allocatable :: zero(:)                   !! zeros for any strip
  end type stages_t

contains

  !> Takes over the rows of a table, without their zeros.
  pure subroutine set_weights(self, inner, update, error, dense)
    type(stages_t), intent(inout) :: self
    real(wp), intent(in) :: inner(:, :)   !! shape [all, all]
    real(wp), intent(in) :: update(:)     !! shape [step]
    real(wp), intent(in) :: error(:)      !! shape [step]
    real(wp), intent(in) :: dense(:, :)   !! shape [all, degree]
    integer :: i

    self%step = size(update)
    self%all = size(inner, 1)
    self%places = self%all
    self%place = [(i, i=1, self%all)]
    allocate (self%inner(self%all), self%dense(size(dense, 2)))
    do i = 1, self%all
      self%inner(i) = combination(inner(i, :))
    end do
    self%update = combination(update)
    self%error = combination(error)
    do i = 1, size(dense, 2)
      self%dense(i) = combination(dense(:, i))
    end do
  end subroutine set_weights

  !> Lets every stage take the place of one that nothing reads any more, once all weights are there: stage i is written
  !> after its state has been formed. The first stage and the last two of the step keep their places throughout.
  pure subroutine share_places(self)
    type(stages_t), intent(inout) :: self
    integer :: last_read(self%all)   ! first stage that may overwrite each stage
    integer :: owner(self%all)       ! stage in each place
    integer :: i, place, stage

    last_read = 0
    do stage = 2, self%all
      call note_reads(self%inner(stage), stage, last_read)
    end do
    call note_reads(self%update, self%step + 1, last_read)
    call note_reads(self%error, self%step + 1, last_read)
    call note_reads(self%coarse_error, self%step + 1, last_read)
    do i = 1, size(self%dense)
      call note_reads(self%dense(i), self%all + 1, last_read)
    end do
    last_read([1, self%step - 1, self%step]) = self%all + 1
    self%places = 0
    do stage = 1, self%all
      do place = 1, self%places
        if (last_read(owner(place)) <= stage) exit
      end do
      self%places = max(self%places, place)
      owner(place) = stage
      self%place(stage) = place
    end do
    do stage = 1, self%all
      call relocate(self%inner(stage), self%place)
    end do
    call relocate(self%update, self%place)
    call relocate(self%error, self%place)
    call relocate(self%coarse_error, self%place)
    do i = 1, size(self%dense)
      call relocate(self%dense(i), self%place)
    end do
  end subroutine share_places

  !> Has a combination read its stages at their places.
  pure subroutine relocate(combination, place)
    type(combination_t), intent(inout) :: combination
    integer, intent(in) :: place(:)   !! of each stage

    associate (read => combination%stages(:combination%terms))
      read = place(read)
    end associate
  end subroutine relocate

  pure subroutine note_reads(combination, stage, last_read)
    type(combination_t), intent(in) :: combination
    integer, intent(in) :: stage
    integer, intent(inout) :: last_read(:)

    associate (read => combination%stages(:combination%terms))
      last_read(read) = max(last_read(read), stage)
    end associate
  end subroutine note_reads

  !> Room for the stages of every lane.
  subroutine allocate_stages(self, system)
    type(stages_t), intent(inout) :: self
    class(system_t), intent(in) :: system
    integer :: columns

    if (allocated(self%k)) deallocate (self%k, self%zero)
    associate (lanes => system%lanes)
      columns = padded_columns(lanes, system%states + system%quadratures)
      allocate (self%k(lanes, columns, self%places), self%zero(min(lanes * columns, strip)), source=0.0_wp)
      call set_offsets(self%inner, lanes * columns, self%places)
      call set_offsets(self%update, lanes * columns, self%places)
      call set_offsets(self%error, lanes * columns, self%places)
      call set_offsets(self%coarse_error, lanes * columns, self%places)
      call set_offsets(self%dense, lanes * columns, self%places)
    end associate
  end subroutine allocate_stages

  !> The state that a stage is taken at, from the stages before it; a lane where it overflows is parked.
  pure subroutine inner_state(self, trial, stage, y)
    type(stages_t), intent(inout) :: self
    type(trial_t), intent(inout) :: trial
    integer, intent(in) :: stage
    real(wp), intent(inout) :: y(trial%length)
    logical :: all_finite

    call combine(self%inner(stage), self%k, trial%length, trial%y, trial%h_length, trial%h_spread, y, all_finite)
    if (.not. all_finite) call leave_infinities(self, trial, y)
  end subroutine inner_state

  !> Parks the lanes where y is not finite, at their start and with nothing in the stages that led there.
  pure subroutine leave_infinities(self, trial, y)
    type(stages_t), intent(inout) :: self
    type(trial_t), intent(inout) :: trial
    real(wp), intent(inout) :: y(trial%lanes, trial%components)
    integer :: lane

    do lane = 1, trial%lanes
      if (all(is_finite(y(lane, :)))) cycle
      if (trial%working(lane)) self%k(lane, :, 2:) = 0.0_wp
      call park(trial, lane, trial_not_finite, findloc(is_finite(y(lane, :)), .false., dim=1))
      y(lane, :) = trial%y(lane, :trial%components)
    end do
  end subroutine leave_infinities

  !> y_new, once its stages are known; a lane where it overflows is parked.
  pure subroutine update_state(self, trial)
    type(stages_t), intent(in) :: self
    type(trial_t), intent(inout) :: trial
    logical :: all_finite

    call combine(self%update, self%k, trial%length, trial%y, trial%h_length, trial%h_spread, trial%y_new, all_finite)
    if (.not. all_finite) call park_infinities(trial, trial%y_new)
  end subroutine update_state

  !> h times a sum of stages.
  pure subroutine weigh(combination, self, trial, y, all_finite)
    type(combination_t), intent(in) :: combination
    type(stages_t), intent(in) :: self
    type(trial_t), intent(in) :: trial
    real(wp), intent(inout) :: y(trial%length)
    logical, intent(out), optional :: all_finite

    call combine(combination, self%k, size(self%zero), self%zero, trial%h_length, trial%h_spread, y, all_finite)
  end subroutine weigh

  !> The deviations of y_new from the embedded solutions, once all stages of the step are known; a lane where one overflows
  !> is parked.
  pure subroutine estimate_error(self, trial)
    type(stages_t), intent(in) :: self
    type(trial_t), intent(inout) :: trial
    logical :: all_finite

    call weigh(self%error, self, trial, trial%deviation, all_finite)
    if (.not. all_finite) call park_infinities(trial, trial%deviation)
    if (.not. trial%has_coarse_deviation) return
    call weigh(self%coarse_error, self, trial, trial%coarse_deviation, all_finite)
    if (.not. all_finite) call park_infinities(trial, trial%coarse_deviation)
  end subroutine estimate_error

  !> The solution inside the last step: y + sum over p of coefficients(:, :, p) theta^p, in the columns that are of interest.
  pure subroutine expand(self, trial, coefficients)
    type(stages_t), intent(in) :: self
    type(trial_t), intent(in) :: trial
    real(wp), intent(inout) :: coefficients(trial%length, size(self%dense))   !! [lanes * padded columns, degree]
    type(combination_t) :: part
    integer :: before, power

    if (trial%last_inside - trial%first_inside + 1 == size(trial%y, 2)) then
      do power = 1, size(self%dense)
        call weigh(self%dense(power), self, trial, coefficients(:, power))
      end do
      return
    end if
    before = trial%lanes * (trial%first_inside - 1)
    do power = 1, size(self%dense)
      part = self%dense(power)
      part%length = trial%lanes * (trial%last_inside - trial%first_inside + 1)
      part%extent = part%extent - before
      call combine(part, self%k(1, trial%first_inside, 1), min(part%length, size(self%zero)), self%zero, &
                   min(part%length, trial%h_length), trial%h_spread, coefficients(before + 1, power))
    end do
  end subroutine expand

end module nocdyn_stages
