!> The stages of a one-step method on a block of lanes, and the sums that are formed of them.
module nocdyn_stages
  use nocdyn_stage_sums, only: stage_sum, stage_sum_t, sum_stages, padded_columns, set_offsets, large_tile
  use nocdyn_finite, only: is_finite
  use nocdyn_kinds, only: wp
  use nocdyn_system, only: system_t
  use nocdyn_step_attempt, only: disable_lane, disable_non_finite_lanes, attempt_not_finite, step_attempt_t
  implicit none (type, external)
  private

  public :: set_tableau, share_storage, allocate_stages, stage_state, update_state, estimate_error, form_dense_output

  type, public :: stages_t
    integer :: step = 0                                !! stages that a step needs
    integer :: all = 0                                 !! those and the ones that only the solution inside the step needs
    type(stage_sum_t), allocatable :: internal(:)       !! states that the stages are taken at, row by row
    type(stage_sum_t) :: update                      !! weights of y_new
    type(stage_sum_t) :: error                       !! weights of the deviation
    type(stage_sum_t) :: low_order_error                !! weights of the coarse deviation; no terms: there is none
    type(stage_sum_t), allocatable :: dense(:)       !! weights of each power of theta = (time - t) / h
    integer :: k_count = 0                              !! for stages in `k`
    integer, allocatable :: k_index(:)                   !! of each stage in `k`, [all]
    real(wp), allocatable :: k(:, :, :)                !! the stages, shape [lanes, padded columns, places]
    real(wp), allocatable :: zero(:)                   !! zeros for any strip
  end type stages_t

contains

  !> Takes over the rows of a table, without their zeros.
  pure subroutine set_tableau(self, internal, update, error, dense)
    type(stages_t), intent(inout) :: self
    real(wp), intent(in) :: internal(:, :)   !! shape [all, all]
    real(wp), intent(in) :: update(:)     !! shape [step]
    real(wp), intent(in) :: error(:)      !! shape [step]
    real(wp), intent(in) :: dense(:, :)   !! shape [all, degree]
    integer :: i

    self%step = size(update)
    self%all = size(internal, 1)
    self%k_count = self%all
    self%k_index = [(i, i=1, self%all)]
    allocate (self%internal(self%all), self%dense(size(dense, 2)))
    do i = 1, self%all
      self%internal(i) = stage_sum(internal(i, :))
    end do
    self%update = stage_sum(update)
    self%error = stage_sum(error)
    do i = 1, size(dense, 2)
      self%dense(i) = stage_sum(dense(:, i))
    end do
  end subroutine set_tableau

  !> Lets every stage take the place of one that nothing reads any more, once all weights are there: stage i is written
  !> after its state has been formed. The first stage and the last two of the step keep their places throughout.
  pure subroutine share_storage(self)
    type(stages_t), intent(inout) :: self
    integer :: last_read(self%all)   ! first stage that may overwrite each stage
    integer :: owner(self%all)       ! stage in each place
    integer :: i, k_index, stage

    last_read = 0
    do stage = 2, self%all
      call note_reads(self%internal(stage), stage, last_read)
    end do
    call note_reads(self%update, self%step + 1, last_read)
    call note_reads(self%error, self%step + 1, last_read)
    call note_reads(self%low_order_error, self%step + 1, last_read)
    do i = 1, size(self%dense)
      call note_reads(self%dense(i), self%all + 1, last_read)
    end do
    last_read([1, self%step - 1, self%step]) = self%all + 1
    self%k_count = 0
    do stage = 1, self%all
      do k_index = 1, self%k_count
        if (last_read(owner(k_index)) <= stage) exit
      end do
      self%k_count = max(self%k_count, k_index)
      owner(k_index) = stage
      self%k_index(stage) = k_index
    end do
    do stage = 1, self%all
      call relocate(self%internal(stage), self%k_index)
    end do
    call relocate(self%update, self%k_index)
    call relocate(self%error, self%k_index)
    call relocate(self%low_order_error, self%k_index)
    do i = 1, size(self%dense)
      call relocate(self%dense(i), self%k_index)
    end do
  end subroutine share_storage

  !> Has a combination read its stages at their places.
  pure subroutine relocate(stage_sum, k_index)
    type(stage_sum_t), intent(inout) :: stage_sum
    integer, intent(in) :: k_index(:)   !! of each stage

    associate (read => stage_sum%stages(:stage_sum%terms))
      read = k_index(read)
    end associate
  end subroutine relocate

  pure subroutine note_reads(stage_sum, stage, last_read)
    type(stage_sum_t), intent(in) :: stage_sum
    integer, intent(in) :: stage
    integer, intent(inout) :: last_read(:)

    associate (read => stage_sum%stages(:stage_sum%terms))
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
      allocate (self%k(lanes, columns, self%k_count), self%zero(min(lanes * columns, large_tile)), source=0.0_wp)
      call set_offsets(self%internal, lanes * columns, self%k_count)
      call set_offsets(self%update, lanes * columns, self%k_count)
      call set_offsets(self%error, lanes * columns, self%k_count)
      call set_offsets(self%low_order_error, lanes * columns, self%k_count)
      call set_offsets(self%dense, lanes * columns, self%k_count)
    end associate
  end subroutine allocate_stages

  !> The state that a stage is taken at, from the stages before it; a lane where it overflows is parked.
  pure subroutine stage_state(self, attempt, stage, y)
    type(stages_t), intent(inout) :: self
    type(step_attempt_t), intent(inout) :: attempt
    integer, intent(in) :: stage
    real(wp), intent(inout) :: y(attempt%length)
    logical :: all_finite

    call sum_stages(self%internal(stage), self%k, attempt%length, attempt%y, attempt%h_length, attempt%h_spread, y, all_finite)
    if (.not. all_finite) call disable_overflowed_lanes(self, attempt, y)
  end subroutine stage_state

  !> Parks the lanes where y is not finite, at their start and with nothing in the stages that led there.
  pure subroutine disable_overflowed_lanes(self, attempt, y)
    type(stages_t), intent(inout) :: self
    type(step_attempt_t), intent(inout) :: attempt
    real(wp), intent(inout) :: y(attempt%lanes, attempt%components)
    integer :: lane

    do lane = 1, attempt%lanes
      if (all(is_finite(y(lane, :)))) cycle
      if (attempt%active(lane)) self%k(lane, :, 2:) = 0.0_wp
      call disable_lane(attempt, lane, attempt_not_finite, findloc(is_finite(y(lane, :)), .false., dim=1))
      y(lane, :) = attempt%y(lane, :attempt%components)
    end do
  end subroutine disable_overflowed_lanes

  !> y_new, once its stages are known; a lane where it overflows is parked.
  pure subroutine update_state(self, attempt)
    type(stages_t), intent(in) :: self
    type(step_attempt_t), intent(inout) :: attempt
    logical :: all_finite

    call sum_stages(self%update, self%k, attempt%length, attempt%y, attempt%h_length, attempt%h_spread, attempt%y_new, all_finite)
    if (.not. all_finite) call disable_non_finite_lanes(attempt, attempt%y_new)
  end subroutine update_state

  !> h times a sum of stages.
  pure subroutine scaled_sum(stage_sum, self, attempt, y, all_finite)
    type(stage_sum_t), intent(in) :: stage_sum
    type(stages_t), intent(in) :: self
    type(step_attempt_t), intent(in) :: attempt
    real(wp), intent(inout) :: y(attempt%length)
    logical, intent(out), optional :: all_finite

    call sum_stages(stage_sum, self%k, size(self%zero), self%zero, attempt%h_length, attempt%h_spread, y, all_finite)
  end subroutine scaled_sum

  !> The deviations of y_new from the embedded solutions, once all stages of the step are known; a lane where one overflows
  !> is parked.
  pure subroutine estimate_error(self, attempt)
    type(stages_t), intent(in) :: self
    type(step_attempt_t), intent(inout) :: attempt
    logical :: all_finite

    call scaled_sum(self%error, self, attempt, attempt%error_estimate, all_finite)
    if (.not. all_finite) call disable_non_finite_lanes(attempt, attempt%error_estimate)
    if (.not. attempt%has_low_order_estimate) return
    call scaled_sum(self%low_order_error, self, attempt, attempt%low_order_estimate, all_finite)
    if (.not. all_finite) call disable_non_finite_lanes(attempt, attempt%low_order_estimate)
  end subroutine estimate_error

  !> The solution inside the last step: y + sum over p of coefficients(:, :, p) theta^p, in the columns that are of interest.
  pure subroutine form_dense_output(self, attempt, coefficients)
    type(stages_t), intent(in) :: self
    type(step_attempt_t), intent(in) :: attempt
    real(wp), intent(inout) :: coefficients(attempt%length, size(self%dense))   !! [lanes * padded columns, degree]
    type(stage_sum_t) :: part
    integer :: before, power

    if (attempt%last_dense - attempt%first_dense + 1 == size(attempt%y, 2)) then
      do power = 1, size(self%dense)
        call scaled_sum(self%dense(power), self, attempt, coefficients(:, power))
      end do
      return
    end if
    before = attempt%lanes * (attempt%first_dense - 1)
    do power = 1, size(self%dense)
      part = self%dense(power)
      part%length = attempt%lanes * (attempt%last_dense - attempt%first_dense + 1)
      part%extent = part%extent - before
      call sum_stages(part, self%k(1, attempt%first_dense, 1), min(part%length, size(self%zero)), self%zero, &
                   min(part%length, attempt%h_length), attempt%h_spread, coefficients(before + 1, power))
    end do
  end subroutine form_dense_output

end module nocdyn_stages
