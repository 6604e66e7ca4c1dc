!> The header of the files of a sweep, from its plan.
module nocdyn_plan_header
  use nocdyn_input, only: group_t
  use nocdyn_input_text, only: input_text
  use nocdyn_sweep_header, only: sweep_header_t
  use nocdyn_sweep_plan, only: sweep_plan_t
  use nocdyn_version, only: compiler_text, version
  implicit none (type, external)
  private

  public :: new_sweep_header

contains

  !> The header of a shard.
  function new_sweep_header(plan, shard, shards) result(header)
    type(sweep_plan_t), intent(in) :: plan
    integer, intent(in) :: shard, shards   !! 1 of 1 is the whole sweep
    type(sweep_header_t) :: header
    type(group_t) :: group

    header%title = plan%input%title()
    header%source = 'nocdyn ' // version // ' (' // compiler_text() // ')'
    group = plan%input%single('sweep')
    header%design = group%text('design')
    if (group%has_value('seed')) header%seed = group%whole_number('seed')
    header%input_file = plan%input%file
    header%input_text = input_text(plan%input)
    header%list_checksum = plan%list_checksum
    header%variants = plan%design%variants
    header%first = first_of_shard(header%variants, shard, shards)
    header%last = first_of_shard(header%variants, shard + 1, shards) - 1
    call name_quantities(plan, header)
  end function new_sweep_header

  !> The first variant of a shard. Shards are equal, but for one variant more in the first ones if there is a remainder.
  pure integer function first_of_shard(variants, shard, shards) result(first)
    integer, intent(in) :: variants, shard, shards

    first = (shard - 1) * (variants / shards) + min(shard - 1, mod(variants, shards)) + 1
  end function first_of_shard

  subroutine name_quantities(plan, header)
    type(sweep_plan_t), intent(in) :: plan
    type(sweep_header_t), intent(inout) :: header
    integer :: i

    allocate (header%parameters(size(plan%targets)), header%results(size(plan%statistics)))
    do i = 1, size(plan%targets)
      header%parameters(i)%label = plan%targets(i)%path
      header%parameters(i)%unit = plan%targets(i)%unit
      header%parameters(i)%long_name = plan%targets(i)%long_name
    end do
    do i = 1, size(plan%statistics)
      header%results(i)%label = plan%statistics(i)%label
      header%results(i)%unit = plan%statistics(i)%unit
      header%results(i)%long_name = plan%statistics(i)%long_name
    end do
  end subroutine name_quantities

end module nocdyn_plan_header
